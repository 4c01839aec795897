//! Stations oriented by targets of known coordinates: `cargo run -p orientation-tasks --example by_targets SURVEY OUT`.

use std::path::PathBuf;

use orientation_tasks::pipeline::Silent;
use orientation_tasks::{OrientBy, OrientRequest, orient};

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1).map(PathBuf::from);
    let (Some(survey), Some(out)) = (arguments.next(), arguments.next()) else {
        return Err("expected a survey with observations.csv and targets.csv, and an output folder".into());
    };
    let by = OrientBy::Targets { sigma_pixel: None, sigma_range_m: None };
    println!("{}", orient(&OrientRequest { survey, by, calibration: None, out }, &Silent)?);
    Ok(())
}
