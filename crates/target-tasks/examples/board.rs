//! Finds a board in a folder of images and writes a survey of what was found.
//!
//! ```text
//! cargo run -p target-tasks --example board -- FOLDER OUT checkerboard 9x6 0.025
//! ```
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::path::PathBuf;

use pipeline::Silent;
use target_tasks::{TargetKind, TargetsRequest, find_targets};

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [survey, out, kind @ ..] = words.as_slice() else {
        return Err("expected FOLDER OUT KIND, such as images found checkerboard 9x6 0.025".into());
    };
    let request = TargetsRequest {
        survey: PathBuf::from(survey),
        calibration: None,
        kind: TargetKind::parse(kind)?,
        principal_distance_px: None,
        board_sigma_m: None,
        out: PathBuf::from(out),
    };
    println!("{}", find_targets(&request, &Silent)?);
    Ok(())
}
