//! Broken networks: is the culprit named, and is no number wrong without a word?
//!
//! ```text
//! cargo run --release -p self-calibration --example calibrations [a word of the faults' names] [seeds]
//! ```
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)]

mod faults;
mod networks;
mod suite;

use std::process::ExitCode;

use suite::Answer;

/// Seeds of each fault on each network, and of each sound network.
const SEEDS: u64 = 5;
const SOUND_SEEDS: u64 = 20;
/// Shares that must be reached: of faults named, and of sound networks that keep their verdict.
const NAMED: f64 = 0.95;
const KEPT: f64 = 0.97;

fn main() -> ExitCode {
    let networks = networks::sound();
    // A word on the command line chooses the faults that have it in their names.
    let asked = std::env::args().nth(1).unwrap_or_default();
    let seeds = std::env::args().nth(2).and_then(|seeds| seeds.parse().ok()).unwrap_or(SEEDS);
    let (mut named, mut silent, mut all) = (0_usize, 0_usize, 0_usize);
    println!("{:<52} {:>14} {:>14} {:>14}", "fault", networks[0].name, networks[1].name, networks[2].name);
    for fault in faults::all().iter().filter(|fault| fault.name.contains(&asked)) {
        let clock = std::time::Instant::now();
        let mut cells = Vec::new();
        let mut words = Vec::new();
        for sound in &networks {
            let answers: Vec<_> = (100..100 + seeds).map(|seed| suite::judge(sound, fault, seed)).collect();
            let right = answers.iter().filter(|(answer, _)| *answer == Answer::Right).count();
            silent += answers.iter().filter(|(answer, _)| *answer == Answer::Silent).count();
            named += right;
            all += answers.len();
            cells.push(format!("{right} of {}", answers.len()));
            let bad = answers.into_iter().filter(|(answer, _)| *answer != Answer::Right);
            words.extend(bad.map(|(answer, words)| format!("    {}: {answer:?}: {words}", sound.name)));
        }
        let seconds = clock.elapsed().as_secs_f64();
        println!("{:<52} {:>14} {:>14} {:>14} {seconds:>8.1} s", fault.name, cells[0], cells[1], cells[2]);
        for words in words {
            println!("{words}");
        }
    }
    let clock = std::time::Instant::now();
    let (mut kept, mut sound_ones) = (0_usize, 0_usize);
    for sound in networks.iter().filter(|_| asked.is_empty() || asked == "sound") {
        for seed in 0..SOUND_SEEDS.min(4 * seeds) {
            sound_ones += 1;
            match suite::is_kept(sound, seed) {
                Ok(()) => kept += 1,
                Err(words) => println!("sound {} {seed}: {words}", sound.name),
            }
        }
    }
    println!("sound networks: {:.1} s", clock.elapsed().as_secs_f64());
    println!("named {named} of {all}, silent wrong numbers {silent}, sound networks kept {kept} of {sound_ones}");
    let reached = named as f64 >= NAMED * all as f64 && silent == 0 && kept as f64 >= KEPT * sound_ones as f64;
    if reached { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
