//! Stations around a furnished room: how well they are brought together, how honest their covariance is, how long it
//! takes.
//!
//! ```text
//! cargo run --release -p multiview-registration --example station_statistics -- [runs] [first seed] [patch, metre] [only=STATIONS]
//! ```
//!
//! `only`: how well so many stations are brought together, one pixel in a hundred wrong, and nothing else.
#![allow(clippy::print_stdout)]

#[path = "../../../point-cloud/tests/common/mod.rs"]
mod common;
#[path = "../../../../xtask/peers/cpu_clock.rs"]
mod cpu_clock;
mod evaluate;
mod limit;

use std::error::Error;

use evaluate::{Survey, accuracy, misplaced, sampling, timing};
use limit::{Plane, cramer_rao};

fn main() -> Result<(), Box<dyn Error>> {
    let runs = std::env::args().nth(1).map_or(Ok(50), |text| text.parse::<u64>())?;
    let seed = std::env::args().nth(2).map_or(Ok(1), |text| text.parse::<u64>())?;
    let only = std::env::args().find_map(|word| Some(word.strip_prefix("only=")?.to_owned()));
    let patch_m = std::env::args().nth(3).filter(|word| !word.starts_with("only="));
    let patch_m = patch_m.map(|text| text.parse::<f64>()).transpose()?;
    if let Some(stations) = only {
        let survey = Survey { stations: stations.parse()?, gross: 0.01, seed, patch_m };
        accuracy(&format!("{stations} stations, 1 % gross errors"), &survey, runs);
        return Ok(());
    }
    for stations in [8, 16] {
        for plane in [Plane::Cells, Plane::Faces] {
            let limit = cramer_rao(stations, plane).ok_or("the stations are not determined")?;
            let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
            println!(
                "{stations} stations, {plane:?} plane: the noise alone leaves {:.2} mm, {:.4} deg for the least known \
                 station (1 sigma), {:.2} mm rms for all",
                largest(&limit.mm),
                largest(&limit.degrees),
                limit.rms_mm(),
            );
        }
    }
    let eight = Survey { stations: 8, gross: 0.01, seed, patch_m };
    accuracy("eight stations, 1 % gross errors", &eight, 10.min(runs));
    let sixteen = Survey { stations: 16, gross: 0.0, seed, patch_m };
    accuracy("sixteen stations", &sixteen, 5.min(runs));
    misplaced("eight stations, 1 % gross errors", &eight, 7.min(runs))?;
    misplaced("sixteen stations", &sixteen, 5.min(runs))?;
    timing(&eight);
    timing(&sixteen);
    sampling(&eight, runs)?;
    Ok(())
}
