//! What `cargo xtask peers registration` measures of this crate, and the frames that everyone gets.
//!
//! ```text
//! registration_peers simulate WHAT FOLDER     writes frames: large, medium, coarse, degenerate, tracking or stations
//! registration_peers capture WHAT FOLDER      writes real frames: dense_kitchen, living_room or sr4000; nothing where they are not
//! registration_peers pairs FOLDER LIST        each pair of a list, from the identity, by frames and by clouds
//! registration_peers tally FOLDER LIST        how many of them are right, by points too
//! registration_peers frames FOLDER STRIDE FIRST COUNT [all]      pairs of frames and of clouds, from the identity
//! registration_peers threads FOLDER           how much faster two threads are, what is possible, whether the bits are the same
//! registration_peers covariance FOLDER COUNT  covariances against true errors
//! registration_peers degenerate FOLDER        scenes that leave motions open
//! registration_peers coarse FOLDER            pairs without a guess
//! registration_peers tracking FOLDER [FIRST COUNT]           a stream of frames, or a part of it
//! registration_peers stations FOLDER          a ring of stations
//! ```
//!
//! A folder of frames holds `camera.txt` (width, height, focal length and centre in pixels), `poses.txt` (three rows of
//! world from camera a line) and `000.f32 ...`: points in the camera's frame (metre, x right, y up, looking along -z),
//! numbers in the machine's own order, NaN where there is no range. A camera with a lens has `directions.f32` too, as
//! points at 1 m, and 0 for its focal length. What is measured is printed as `name figure...`;
//! times are CPU time of the one thread that works (Linux).
#![allow(clippy::print_stdout)]

mod captures;
mod coarse;
#[path = "../../../point-cloud/tests/common/mod.rs"]
mod common;
#[path = "../../../../xtask/peers/cpu_clock.rs"]
mod cpu_clock;
#[path = "../../../projective-registration/tests/depth_frames/mod.rs"]
mod depth_frames;
mod files;
mod frames;
mod pairs;
mod real;
mod simulate;
#[path = "../../../projective-registration/tests/sr4000/mod.rs"]
mod sr4000;
mod stations;
mod threads;
mod tracking;
mod verdicts;

use std::error::Error;
use std::path::Path;

/// Why a command cannot be done.
type Failure = Box<dyn Error + Send + Sync>;
/// What a command answers.
type Outcome = Result<(), Failure>;

fn main() -> Outcome {
    // One thread, as for everyone else.
    rayon::ThreadPoolBuilder::new().num_threads(1).build()?.install(run)
}

fn run() -> Outcome {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words.as_slice() {
        ["simulate", what, folder] => simulate::write(what, Path::new(folder)),
        ["capture", what, folder] => captures::write(what, Path::new(folder)),
        ["pairs", folder, list] => real::pairs(Path::new(folder), Path::new(list)),
        ["tally", folder, list] => real::tally(Path::new(folder), Path::new(list)),
        ["frames", folder, rest @ ..] => frames::run(Path::new(folder), rest),
        ["threads", folder] => threads::run(Path::new(folder)),
        ["covariance", folder, count] => verdicts::covariance(Path::new(folder), count.parse()?),
        ["degenerate", folder] => verdicts::degenerate(Path::new(folder)),
        ["coarse", folder] => coarse::run(Path::new(folder)),
        ["tracking", folder] => tracking::run(Path::new(folder), 0, usize::MAX),
        ["tracking", folder, first, count] => tracking::run(Path::new(folder), first.parse()?, count.parse()?),
        ["stations", folder] => stations::run(Path::new(folder)),
        _ => Err("see the head of registration_peers/main.rs for what can be asked".into()),
    }
}
