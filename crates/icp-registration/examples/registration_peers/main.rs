//! What `cargo xtask peers registration` measures of this crate, and the frames that everyone gets.
//!
//! ```text
//! registration_peers simulate WHAT FOLDER     writes frames: large, medium, coarse, degenerate, tracking or stations
//! ```
//!
//! A folder of frames holds `camera.txt` (width, height, focal length and centre in pixels), `poses.txt` (three rows of
//! world from camera a line) and `000.f32 ...`: points in the camera's frame (metre, x right, y up, looking along -z),
//! numbers in the machine's own order, NaN where there is no range. What is measured is printed as `name figure...`;
//! times are CPU time of the one thread that works (Linux).
#![allow(clippy::print_stdout)]

#[path = "../../tests/common/mod.rs"]
mod common;
mod files;
mod simulate;

use std::error::Error;
use std::path::Path;

/// What a command answers.
type Outcome = Result<(), Box<dyn Error + Send + Sync>>;

fn main() -> Outcome {
    // One thread, as for everyone else.
    rayon::ThreadPoolBuilder::new().num_threads(1).build()?.install(run)
}

fn run() -> Outcome {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words.as_slice() {
        ["simulate", what, folder] => simulate::write(what, Path::new(folder)),
        _ => Err("see the head of registration_peers/main.rs for what can be asked".into()),
    }
}
