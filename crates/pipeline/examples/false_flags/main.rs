//! How many pixels are flagged though they are right, in a room of the simulator and in a second room that has nothing in
//! common with it, in three lights and with 1 to 1,000 frames.
//!
//! `cargo xtask verify flags`; with the argument `tuning` on the stations and seeds that constants were chosen on, else on
//! others. Fails where false flags are more than twice the wrong pixels and 2 % of all, or where a mean of many frames has more
//! of them than a single frame of the same light and noise, whose samples are the sums of theirs: flags of single frames
//! must not add up in their mean. What the smaller noise of a mean shows, more light shows as well.
#![allow(clippy::print_stdout)]

mod caster;
mod judge;
mod rooms;

use std::path::Path;

use judge::{Counts, count, count_of_sum};
use range_image::Flags;
use rooms::{Amount, Capture};

type Failure = Box<dyn std::error::Error>;

/// Median amplitudes: dim, usual, bright; samples have noise of 4 units and more.
const LIGHTS: [f64; 3] = [27.0, 100.0, 400.0];

type Take = fn(&Path, usize, Amount) -> Result<Capture, Failure>;

const ROOMS: [(&str, Take); 4] = [
    ("simulated", rooms::simulated),
    ("attic", |folder, first, amount| rooms::cast(folder, first, &[30e6], amount)),
    ("attic, 80 and 60 MHz", |folder, first, amount| rooms::cast(folder, first, &[80e6, 60e6], amount)),
    ("attic, 20 MHz", |folder, first, amount| rooms::cast(folder, first, &[20e6], amount)),
];

fn main() -> Result<(), Failure> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let tuning = words.iter().any(|word| word == "tuning");
    let only = words.iter().find_map(|word| word.strip_prefix("room="));
    let most = words.iter().find_map(|word| word.strip_prefix("frames=")?.parse().ok()).unwrap_or(usize::MAX);
    let (first, seed) = if tuning { (0, 1) } else { (3, 1001) };
    println!(
        "{} stations and seeds; percent of all pixels, far mixed: found, percent of these\n\n{}",
        if tuning { "the tuning" } else { "other" },
        heading()
    );
    let mut broken = Vec::new();
    for (name, take) in ROOMS.iter().filter(|(name, _)| only.is_none_or(|only| only == *name)) {
        for amplitude in LIGHTS {
            let place = format!("{name}, {amplitude}");
            // A thousand frames of one station are plenty.
            for (stations, frames) in [(3, [1, 4, 16, 64].as_slice()), (1, [64, 1000].as_slice())] {
                let frames: Vec<usize> = frames.iter().copied().filter(|frames| *frames <= most).collect();
                let Some(&last) = frames.last().filter(|last| stations > 1 || **last > 64) else { continue };
                let folder = tempfile::tempdir()?;
                let capture = take(folder.path(), first, Amount { stations, frames: last, seed, amplitude })?;
                broken.extend(judged(&place, &capture, &frames)?.into_iter().map(|why| format!("{place}: {why}")));
            }
        }
    }
    for words in &broken {
        println!("{words}");
    }
    if broken.is_empty() { Ok(()) } else { Err(format!("{} bars are broken", broken.len()).into()) }
}

/// Prints the counts with each number of frames, and of a single frame of the same noise; where they break the bar.
fn judged(place: &str, capture: &Capture, frames: &[usize]) -> Result<Vec<String>, Failure> {
    let mut broken = Vec::new();
    for &frames in frames {
        let counts = count(capture, frames)?;
        println!("{}", line(place, &frames.to_string(), &counts));
        let percent = |share: f64| format!("{:.2} %", 100.0 * share);
        let share = counts.share(counts.false_flags);
        let found = format!("{frames} frames: {} false flags", percent(share));
        if share > counts.bar() {
            broken.push(format!("{found}, {} are allowed", percent(counts.bar())));
        }
        if frames == 1 {
            continue;
        }
        let of_sum = count_of_sum(capture, frames)?;
        println!("{}", line(place, "sum", &of_sum));
        if counts.is_above(&of_sum) {
            let of_sum = percent(of_sum.share(of_sum.false_flags));
            broken.push(format!("{found}, {of_sum} in a single frame of this noise"));
        }
    }
    Ok(broken)
}

fn heading() -> String {
    let figures = ["error mm", "flagged", "wrong", "false", "narrow", "bar", "missed", "far mixed"];
    let names: Vec<&str> = figures.into_iter().chain(Flags::NAMED.iter().map(|(_, name)| *name)).collect();
    format!("| room, median amplitude | frames | {} |\n|{}", names.join(" | "), "---|".repeat(names.len() + 2))
}

fn line(place: &str, frames: &str, counts: &Counts) -> String {
    let percent = |count: usize| format!("{:.2}", 100.0 * counts.share(count));
    let [flagged, wrong, of_right, narrow, missed] =
        [counts.flagged, counts.wrong, counts.false_flags, counts.false_of_narrow, counts.missed].map(percent);
    let of_flag: Vec<String> = counts.of_flag.iter().map(|count| percent(*count)).collect();
    format!(
        "| {place} | {frames} | {:.1} | {flagged} | {wrong} | {of_right} | {narrow} | {:.2} | {missed} | {:.1} | {} |",
        1e3 * counts.error_median_m,
        100.0 * counts.bar(),
        100.0 * counts.far_mixed_found as f64 / counts.far_mixed as f64,
        of_flag.join(" | ")
    )
}
