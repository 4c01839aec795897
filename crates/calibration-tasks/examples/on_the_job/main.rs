//! Calibration from surfaces over many surveys of a simulated scene: what it leaves of the ranges' errors beside the true calibration,
//! whether its covariance is true, term by term, whether the points of a whole run err as stated, and how often `check` is right.
//!
//! `cargo run --release -p calibration-tasks --example on_the_job [SURVEYS] [SCENE.ron] [FIRST_SEED] [FOLDER]`
//!
//! A survey's figures are kept in FOLDER as soon as they are there (default: a folder that is thrown away), and a survey that has its
//! figures there is not taken again: a run that was ended goes on, and tables are printed every tenth survey.
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

mod points;
mod survey;
mod tables;

use std::path::{Path, PathBuf};

use crate::survey::{Bench, SurveyFigures};

/// Surveys between tables.
const BETWEEN: usize = 10;

fn main() {
    let mut words = std::env::args().skip(1);
    let surveys: u64 = words.next().and_then(|word| word.parse().ok()).unwrap_or(20);
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures");
    let scene = words.next().map_or(fixtures.join("scenes/room_small.ron"), PathBuf::from);
    let first: u64 = words.next().and_then(|word| word.parse().ok()).unwrap_or(1);
    let thrown_away = tempfile::tempdir().unwrap();
    let folder = words.next().map_or(thrown_away.path().to_owned(), PathBuf::from);
    std::fs::create_dir_all(&folder).unwrap();
    let bench = Bench::new(&fixtures, scene, folder);
    let mut all: Vec<SurveyFigures> = Vec::new();
    let mut refused = 0;
    println!("{}", SurveyFigures::HEAD);
    for seed in first..first + surveys {
        let figures = bench.figures(seed, (seed > first).then(|| seed - 1));
        let Some(figures) = figures else {
            refused += 1;
            continue;
        };
        println!("{figures}");
        all.push(figures);
        if all.len().is_multiple_of(BETWEEN) && (all.len() as u64) < surveys {
            println!("{}", tables::tables(&all, &bench));
        }
    }
    println!("{}", tables::tables(&all, &bench));
    println!("surveys with a refused calibration, in no figure: {refused}");
}
