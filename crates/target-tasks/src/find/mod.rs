//! Targets in the frames of a survey: observations, coordinates, and a page that shows them.

mod document;
mod pictures;
mod request;
mod sightings;
mod single;
mod station;
mod summary;
mod write;

use std::time::Instant;

use atomic_output::Destination;
use commands::{Inputs, Progress, json, produce};
use pipeline::{Error, Result};

use crate::kind::TargetKind;
use pictures::Pictures;
use sightings::Sighting;
use single::Singles;
use station::StationPicture;

pub use request::TargetsRequest;
pub use station::LeftOut;
pub use summary::{MissingStation, StationSummary, TargetsSummary};

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
    let singles = match &request.kind {
        TargetKind::Board(_) => None,
        TargetKind::Single(kind) => Some(Singles::new(*kind, request, &pictures)?),
    };
    let mut stations = Vec::new();
    pictures.each(&mut |picture| {
        stations.push(match (&request.kind, &singles) {
            (TargetKind::Board(kind), _) => StationPicture::of_board(Sighting::new(picture, kind)?, kind),
            (TargetKind::Single(_), Some(singles)) => singles.station(picture)?,
            (TargetKind::Single(_), None) => return Ok(()),
        });
        progress.advance(1);
        Ok(())
    })?;
    if let Some(singles) = &singles {
        singles.check_codes(&mut stations)?;
    }
    progress.finish();
    let boards: Vec<_> =
        stations.iter().filter_map(|station| station.seen.as_ref().ok()).map(|seen| seen.pairs.clone()).collect();
    let camera = pictures.camera(request, &boards)?;
    let mut summary = TargetsSummary::new(request, &pictures, &camera, &stations);
    if summary.stations.is_empty() {
        return Err(Error::Refused { summary: json(&summary)?, source: summary.nothing_found().into(), written: None });
    }
    summary.seconds = commands::made::seconds_since(clock);
    let page = document::document(&summary, &stations)?;
    let found = write::Found { pictures: &pictures, camera: &camera, singles: singles.as_ref(), stations: &stations };
    write::write(destination, request, &found, (&json(&summary)?, &page.html()))?;
    Ok(summary)
}
