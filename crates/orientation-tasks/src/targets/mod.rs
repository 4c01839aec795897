//! Stations by targets: control, or tie points alone.

mod control;
mod sightings;
mod ties;

use pipeline::{Error, Result};
use range_io::tables::{PlacedRows, read_placed_observations, read_placed_targets};

use crate::camera::SurveyCamera;
use crate::outcome::Outcome;
use sightings::Sightings;

/// Orients every station of `observations.csv`.
pub(crate) fn orient(camera: &SurveyCamera, sigmas: [Option<f64>; 2]) -> Result<Outcome> {
    let observations = read_placed_observations(camera.root.join("observations.csv"))?;
    if observations.rows.is_empty() {
        let message = "has no rows, expected target observations".to_owned();
        return Err(Error::Survey { path: observations.file().to_owned(), message });
    }
    let sightings = Sightings::new(camera, &observations, sigmas)?;
    let file = camera.root.join("targets.csv");
    let targets = if file.is_file() { read_placed_targets(&file)? } else { PlacedRows::none(&file) };
    let mut outcome = if targets.rows.is_empty() {
        ties::orient(camera, &sightings)?
    } else {
        control::orient(camera, &sightings, &targets.rows)
    };
    if sightings.uses_ranges() {
        outcome.summary.doubts.extend(camera.doubt_of_ranges());
    }
    outcome.summary.doubts.extend(camera.doubts.iter().cloned());
    if sightings.without_range > 0 {
        outcome.summary.findings.push(format!(
            "{} ranges lie outside the span of the range models, or have no amplitude, and took no part",
            sightings.without_range
        ));
    }
    Ok(outcome)
}
