//! Targets in the frames of a survey: observations, coordinates, and a page that shows them.

mod document;
mod pictures;
mod sightings;
mod summary;
mod write;

use std::path::PathBuf;
use std::time::Instant;

use atomic_output::Destination;
use commands::{Inputs, Progress, json, produce};
use pipeline::{Error, Result};

use crate::kind::TargetKind;
use pictures::Pictures;
use sightings::Sighting;

pub use summary::{BoardSummary, MissingBoard, TargetsSummary};

/// Where to look for which targets.
#[derive(Debug, Clone)]
pub struct TargetsRequest {
    /// A survey of any level, or a folder of images of one camera (PNG, JPEG), each of them a station.
    pub survey: PathBuf,
    /// Calibration whose scattering is taken off, and that is handed on; `None`: the one beside the survey, if there is one.
    pub calibration: Option<PathBuf>,
    /// What is looked for.
    pub kind: TargetKind,
    /// Principal distance of a folder of images, pixel; `None`: from the perspective of the boards.
    pub principal_distance_px: Option<f64>,
    /// Standard deviation of the board's coordinates in each axis, written into `targets.csv` as control, metre; `None`: none
    /// is written, and the coordinates are approximate.
    pub board_sigma_m: Option<f64>,
    /// Output folder; written beside and renamed when everything is done.
    pub out: PathBuf,
}

/// Looks for targets in all stations of a survey and writes a survey of what was found (`survey.ron`, `observations.csv`,
/// `targets.csv`), which a calibration takes as it is, with `summary.json` and `report.html`.
///
/// # Errors
/// [`Error::Refused`] where no station shows the target. Every other error leaves what was there.
pub fn find_targets(request: &TargetsRequest, progress: &dyn Progress) -> Result<TargetsSummary> {
    check(request)?;
    let inputs = Inputs::default().survey(&request.survey).maybe(request.calibration.as_deref());
    produce(&request.out, &inputs, |destination| find(request, destination, progress))
}

fn check(request: &TargetsRequest) -> Result<()> {
    let numbers = [("--principal-distance", request.principal_distance_px), ("--board-sigma", request.board_sigma_m)];
    match numbers.into_iter().find(|(_, value)| value.is_some_and(|value| !(value > 0.0 && value.is_finite()))) {
        Some((name, value)) => {
            let message = format!("{name} is {}, expected a positive number", value.unwrap_or_default());
            Err(Error::Request { command: "targets", message })
        }
        None => Ok(()),
    }
}

fn find(request: &TargetsRequest, destination: &Destination, progress: &dyn Progress) -> Result<TargetsSummary> {
    let clock = Instant::now();
    let pictures = Pictures::open(request)?;
    progress.begin("find targets", pictures.stations());
    let mut sightings = Vec::new();
    pictures.each(&mut |picture| {
        sightings.push(Sighting::new(picture, &request.kind)?);
        progress.advance(1);
        Ok(())
    })?;
    progress.finish();
    let camera = pictures.camera(request, &sightings)?;
    let mut summary = TargetsSummary::new(request, &pictures, &camera, &sightings);
    if summary.boards.is_empty() {
        return Err(Error::Refused { summary: json(&summary)?, source: summary.nothing_found().into(), written: None });
    }
    summary.seconds = clock.elapsed().as_secs_f64();
    let page = document::document(&summary, &sightings, &request.kind)?;
    write::write(destination, request, &pictures, &camera, &sightings, (&json(&summary)?, &page.html()))?;
    Ok(summary)
}
