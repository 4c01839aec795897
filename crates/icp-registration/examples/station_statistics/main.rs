//! Stations around a furnished room: how well they are brought together, how honest their covariance is, how long it
//! takes.
//!
//! ```text
//! cargo run --release -p icp-registration --features multiview --example station_statistics -- [runs]
//! ```
#![allow(clippy::print_stdout)]

#[path = "../../tests/common/mod.rs"]
mod common;
mod cpu;
mod evaluate;

use std::error::Error;

use evaluate::{Survey, accuracy, sampling, timing};

fn main() -> Result<(), Box<dyn Error>> {
    let runs = std::env::args().nth(1).map_or(Ok(50), |text| text.parse::<u64>())?;
    let eight = Survey { stations: 8, gross: 0.01, seed: 1 };
    accuracy("eight stations, 1 % gross errors", &eight, 10.min(runs))?;
    let sixteen = Survey { stations: 16, gross: 0.0, seed: 1 };
    accuracy("sixteen stations", &sixteen, 5.min(runs))?;
    timing(&eight)?;
    timing(&sixteen)?;
    sampling(&eight, runs)?;
    Ok(())
}
