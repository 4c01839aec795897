//! Stations of a survey, oriented: from files to files.

use std::time::Instant;

use atomic_output::{Destination, write_text};
use commands::{Inputs, Progress, json, produce};
use pipeline::{Error, Result};
use range_io::tables::write_stations;
use range_io::trajectory::{StampedPose, write_tum};

use crate::camera::SurveyCamera;
use crate::outcome::{Outcome, Placed};
use crate::request::{OrientBy, OrientRequest};
use crate::summary::OrientSummary;
use crate::{document, imu, targets, tracker};

/// Orients the stations of a survey by targets, by an inertial unit, or by poses of a tracker, and writes `stations.csv` with standard
/// deviations, `trajectory.txt` where stations have times, `summary.json` and `report.html`.
///
/// # Errors
/// [`Error::Refused`] where no station can be oriented; [`Error::Request`] where an input is wrong as a whole, with what would make
/// it fit (positions in millimetres, clocks that do not overlap, quaternions in another order). Every error leaves what was there.
pub fn orient(request: &OrientRequest, progress: &dyn Progress) -> Result<OrientSummary> {
    let inputs = Inputs::default().survey(&request.survey).maybe(request.calibration.as_deref());
    let inputs = match &request.by {
        OrientBy::Targets { .. } => inputs,
        OrientBy::Imu { known } => inputs.maybe(known.as_deref()),
        OrientBy::Tracker(options) => inputs.path(&options.poses).maybe(options.known.as_deref()),
    };
    produce(&request.out, &inputs, |destination| work(request, destination, progress))
}

fn work(request: &OrientRequest, destination: &Destination, progress: &dyn Progress) -> Result<OrientSummary> {
    let clock = Instant::now();
    progress.begin("orient", 1);
    let camera = SurveyCamera::open(&request.survey, request.calibration.as_deref())?;
    let mut outcome = match &request.by {
        OrientBy::Targets { sigma_pixel, sigma_range_m } => targets::orient(&camera, [*sigma_pixel, *sigma_range_m])?,
        OrientBy::Imu { known } => imu::orient(&camera, known.as_deref())?,
        OrientBy::Tracker(options) => tracker::orient(&camera, options)?,
    };
    progress.advance(1);
    progress.finish();
    outcome.finish();
    let summary = &mut outcome.summary;
    summary.by = request.by.name();
    summary.survey = request.survey.display().to_string();
    summary.calibration.clone_from(&camera.calibration_words);
    summary.out.clone_from(&request.out);
    summary.seconds = commands::made::seconds_since(clock);
    if summary.stations.is_empty() {
        let reason = match summary.not_oriented.first() {
            Some(first) => format!("no station could be oriented; {}: {}", first.station, first.reason),
            None => "no station could be oriented".to_owned(),
        };
        return Err(Error::Refused { summary: json(summary)?, source: reason.into(), written: None });
    }
    write(destination, &outcome)?;
    Ok(outcome.summary)
}

fn write(destination: &Destination, outcome: &Outcome) -> Result<()> {
    let page = document::document(&outcome.summary);
    let folder = destination.open()?;
    write_stations(folder.file("stations.csv")?, &outcome.rows())?;
    let pose = |station: &Placed| {
        let world_from_camera = station.pose.world_from_camera;
        Some(StampedPose { timestamp_s: station.timestamp_s?, world_from_camera })
    };
    let poses: Option<Vec<StampedPose>> = outcome.stations.iter().map(pose).collect();
    if let Some(poses) = poses {
        write_tum(folder.file("trajectory.txt")?, &poses)?;
    }
    write_text(folder.file("summary.json")?, &json(&outcome.summary)?)?;
    write_text(folder.file("report.html")?, &page.html())?;
    folder.commit()?;
    Ok(())
}
