//! Broken networks: is the culprit named, and is no number wrong without a word?
//!
//! ```text
//! cargo run --release -p self-calibration --example calibrations [a word of the faults' names] [seeds]
//! ```
//! Every fault is done to three networks that it suits, those that every method meets also to networks of the other methods
//! and to automatic terms. An answer is named rightly, refused or doubted for another reason, given without a word though
//! its numbers are right, or a silent wrong number. With the word `sound`, only sound networks are looked at.
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)]

mod faults;
mod networks;
mod suite;

use std::process::ExitCode;
use std::time::Instant;

use faults::{Fault, On};
use networks::Sound;
use rayon::prelude::*;
use suite::Answer;

/// Seeds of each fault on each network, and of each sound network.
const SEEDS: u64 = 1;
const SOUND_SEEDS: u64 = 16;
/// Shares that must be reached: of faults named, and of sound networks that keep their verdict.
const NAMED: f64 = 0.95;
const KEPT: f64 = 0.97;

/// A fault done to a network.
struct Trial<'s> {
    fault: &'s Fault,
    sound: &'s Sound,
    seed: u64,
}

/// What came of it.
struct Outcome {
    answer: Answer,
    words: String,
    seconds: f64,
}

fn main() -> ExitCode {
    // A word on the command line chooses the faults that have it in their names.
    let asked = std::env::args().nth(1).unwrap_or_default();
    let seeds = std::env::args().nth(2).and_then(|seeds| seeds.parse().ok()).unwrap_or(SEEDS);
    let groups = [networks::sound(), networks::with_control(), networks::with_stations()];
    let methods = networks::by_method();
    let faults = faults::all();
    let chosen = faults.iter().filter(|fault| fault.name.contains(&asked));
    let trials = chosen.flat_map(|fault| {
        let own = groups[[On::Any, On::Control, On::Stations].iter().position(|on| *on == fault.on).unwrap()].iter();
        let more = methods.iter().filter(|sound| fault.is_for(sound));
        let of_sound = move |sound| (100..100 + seeds).map(move |seed| Trial { fault, sound, seed });
        own.chain(more).flat_map(of_sound)
    });
    let trials: Vec<Trial<'_>> = trials.collect();
    let outcomes: Vec<Outcome> = trials.par_iter().map(run).collect();
    table(&trials, &outcomes);
    let count = |answer| outcomes.iter().filter(|outcome| outcome.answer == answer).count();
    let [named, other, harmless, silent] =
        [Answer::Right, Answer::NotNamed, Answer::Harmless, Answer::Silent].map(count);
    println!(
        "{} broken networks: {named} named, {other} refused or doubted for another reason, {harmless} given with right \
         numbers, {silent} silent wrong numbers",
        trials.len()
    );
    let sound: Vec<&Sound> = groups.iter().flatten().chain(&methods).collect();
    let (kept, all) =
        if asked.is_empty() || asked == "sound" { sound_networks(&sound, SOUND_SEEDS * seeds) } else { (0, 0) };
    let reached = named as f64 >= NAMED * trials.len() as f64 && silent == 0 && kept as f64 >= KEPT * all as f64;
    if reached { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn run(trial: &Trial<'_>) -> Outcome {
    let clock = Instant::now();
    let (answer, words) = suite::judge(trial.sound, trial.fault, trial.seed);
    Outcome { answer, words, seconds: clock.elapsed().as_secs_f64() }
}

/// One row for each fault, and the words of all answers that are not right.
fn table(trials: &[Trial<'_>], outcomes: &[Outcome]) {
    println!("| fault | named | another reason | harmless | silent | longest, s |\n|---|---|---|---|---|---|");
    let pairs: Vec<_> = trials.iter().zip(outcomes).collect();
    for own in pairs.chunk_by(|a, b| a.0.fault.name == b.0.fault.name).chain([pairs.as_slice()]) {
        let count = |answer| own.iter().filter(|(_, outcome)| outcome.answer == answer).count();
        let [named, other, harmless, silent] =
            [Answer::Right, Answer::NotNamed, Answer::Harmless, Answer::Silent].map(count);
        let longest = own.iter().map(|(_, outcome)| outcome.seconds).fold(0.0, f64::max);
        let name = if own.len() == pairs.len() { "all" } else { own[0].0.fault.name };
        println!("| {name} | {named} | {other} | {harmless} | {silent} | {longest:.1} |");
    }
    println!();
    for (trial, outcome) in pairs.iter().filter(|(_, outcome)| outcome.answer != Answer::Right) {
        let (fault, name, seed) = (trial.fault.name, &trial.sound.name, trial.seed);
        println!("{fault}, {name} {seed}: {:?}: {}", outcome.answer, outcome.words);
    }
}

/// How many sound networks keep their verdict, and of how many.
fn sound_networks(sound: &[&Sound], seeds: u64) -> (usize, usize) {
    let clock = Instant::now();
    let trials: Vec<(&Sound, u64)> = sound.iter().flat_map(|sound| (0..seeds).map(|seed| (*sound, seed))).collect();
    let answers: Vec<Result<(), String>> =
        trials.par_iter().map(|(sound, seed)| suite::is_kept(sound, *seed)).collect();
    for ((sound, seed), answer) in trials.iter().zip(&answers) {
        if let Err(words) = answer {
            println!("sound {} {seed}: {words}", sound.name);
        }
    }
    let kept = answers.iter().filter(|answer| answer.is_ok()).count();
    println!("\n| sound networks | keep their verdict | s |\n|---|---|---|");
    println!("| {} | {kept} | {:.1} |", trials.len(), clock.elapsed().as_secs_f64());
    (kept, trials.len())
}
