//! What `cargo xtask peers phase` measures of this crate, and the images that everyone gets.
//!
//! ```text
//! peers_phase scene room|hills WIDTH HEIGHT FOLDER       writes phase, amplitude and truth
//! peers_phase tree|noisy WIDTH HEIGHT FOLDER             unwraps them, writes wrap counts
//! peers_phase absolute plain|dark WIDTH HEIGHT SEED      absolute counts of one frequency, with their confidence
//! peers_phase phases WIDTH HEIGHT FOLDER SIGMA HZ...     writes phases of several frequencies
//! peers_phase frequencies WIDTH HEIGHT FOLDER HZ...      unwraps them, writes counts of the first
//! ```
//!
//! Planes are rows of numbers in the machine's own order, `f32`, counts `i32`. What is measured is printed as
//! `name figure`; times are CPU time of the one thread that works (Linux).
#![allow(clippy::print_stdout)]

mod absolute;
#[path = "../../../../xtask/peers/cpu_clock.rs"]
mod cpu_clock;
mod files;
mod frequencies;
mod hills;
mod measure;
mod room;
mod spatial;

use std::error::Error;

/// What a command answers.
type Outcome = Result<(), Box<dyn Error + Send + Sync>>;

/// Width and height of an image, pixels.
type Size = [usize; 2];

fn main() -> Outcome {
    // One thread, as for everyone else.
    rayon::ThreadPoolBuilder::new().num_threads(1).build()?.install(run)
}

fn run() -> Outcome {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words.as_slice() {
        ["scene", "room", width, height, folder] => {
            let size = size(width, height)?;
            room::Room::new(1, room::Patches::WithDark, size).view(2).write(folder)
        }
        ["scene", "hills", width, height, folder] => hills::write(size(width, height)?, folder),
        ["tree", width, height, folder] => spatial::tree(size(width, height)?, folder),
        ["noisy", width, height, folder] => spatial::noisy(size(width, height)?, folder),
        ["absolute", albedo @ ("plain" | "dark"), width, height, seed] => {
            let patches = if *albedo == "dark" { room::Patches::WithDark } else { room::Patches::Plain };
            absolute::run(patches, size(width, height)?, seed.parse()?)
        }
        ["phases", width, height, folder, sigma, hz @ ..] => {
            frequencies::write(size(width, height)?, folder, sigma.parse()?, hz)
        }
        ["frequencies", width, height, folder, hz @ ..] => frequencies::unwrap(size(width, height)?, folder, hz),
        _ => Err("see the head of peers_phase/main.rs for what can be asked".into()),
    }
}

fn size(width: &str, height: &str) -> Result<Size, Box<dyn Error + Send + Sync>> {
    Ok([width.parse()?, height.parse()?])
}
