//! Stations around a furnished room: how well they are brought together, how honest their covariance is, how long it
//! takes.
//!
//! ```text
//! cargo run --release -p icp-registration --features multiview --example station_statistics -- [runs] [first seed] [patch, metre]
//! ```
#![allow(clippy::print_stdout)]

#[path = "../../tests/common/mod.rs"]
mod common;
#[path = "../../../../xtask/peers/cpu_clock.rs"]
mod cpu_clock;
mod evaluate;
mod limit;

use std::error::Error;

use evaluate::{Survey, accuracy, sampling, timing};

fn main() -> Result<(), Box<dyn Error>> {
    let runs = std::env::args().nth(1).map_or(Ok(50), |text| text.parse::<u64>())?;
    let seed = std::env::args().nth(2).map_or(Ok(1), |text| text.parse::<u64>())?;
    let patch_m = std::env::args().nth(3).map(|text| text.parse::<f64>()).transpose()?;
    for stations in [8, 16] {
        let (mm, degrees) = limit::cramer_rao(stations);
        println!(
            "{stations} stations: the noise alone leaves {mm:.2} mm, {degrees:.4} deg (least known station, 1 sigma)"
        );
    }
    let eight = Survey { stations: 8, gross: 0.01, seed, patch_m };
    accuracy("eight stations, 1 % gross errors", &eight, 10.min(runs));
    let sixteen = Survey { stations: 16, gross: 0.0, seed, patch_m };
    accuracy("sixteen stations", &sixteen, 5.min(runs));
    timing(&eight);
    timing(&sixteen);
    sampling(&eight, runs)?;
    Ok(())
}
