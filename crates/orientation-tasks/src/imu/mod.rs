//! Stations by an inertial unit alone, from poses that are known.

mod anchor;
mod rest;

use std::path::Path;

use commands::{Doubt, DoubtKind, InertialUnit, read_inertial};
use inertial::{CameraPose, Mounting, SequenceOptions, estimate_sequence};
use orientation::TimedPose;
use pipeline::survey::StationPose;
use pipeline::{Error, Result};

use crate::camera::SurveyCamera;
use crate::known::Known;
use crate::outcome::{Outcome, Placed};
use crate::summary::{InertialSummary, NotOriented, OrientSummary, SigmaAtTime};
use anchor::Anchor;

/// Taken where the survey names no data.
const FILE: &str = "imu.csv";
/// Known poses from which on velocities and biases come from their sequence.
const SEQUENCE: usize = 4;
/// Lines of the table that says how well a pose is known after how long.
const GROWTH: usize = 12;

pub(crate) fn orient(camera: &SurveyCamera, known: Option<&Path>) -> Result<Outcome> {
    let unit = read_unit(camera)?;
    let InertialUnit { samples, camera_from_body, noise } = &unit;
    let mut stations = camera.timed_stations()?;
    stations.sort_by(|a, b| a.1.total_cmp(&b.1));
    let known = Known::read(camera, known)?;
    let mut summary = OrientSummary {
        datum: format!(
            "the frame of the known poses (the first of station {})",
            known.names.first().cloned().unwrap_or_default()
        ),
        ..OrientSummary::default()
    };
    let anchors = if known.poses.len() >= SEQUENCE {
        of_sequence(camera, &known, &unit, &mut summary)?
    } else {
        let first = known.poses.first().copied();
        let first = first.ok_or_else(|| wrong("no pose is known to begin with"))?;
        let start = rest::at_rest(samples, &first, camera_from_body, noise).map_err(|words| wrong(&words))?;
        vec![start]
    };
    summary.findings.extend(known.assumed());
    let (mut placed, mut growth) = (Vec::new(), Vec::new());
    for (name, time_s) in stations {
        let before = anchors.partition_point(|anchor| anchor.time_s <= time_s);
        let Some(anchor) = before.checked_sub(1).and_then(|index| anchors.get(index)) else {
            let reason = format!("its time, {time_s} s, lies before the first known pose");
            summary.not_oriented.push(NotOriented { station: name, reason });
            continue;
        };
        match anchor.camera_at(samples, time_s, camera_from_body, noise) {
            Ok(found) => {
                let pose = StationPose { world_from_camera: found.pose, covariance: Some(found.covariance) };
                let station = Placed::new(&name, Some(time_s), pose);
                if let Some([position_m, attitude_deg]) = station.sigmas() {
                    growth.push(SigmaAtTime { seconds: time_s - anchor.time_s, position_m, attitude_deg });
                }
                placed.push(station);
            }
            Err(error) => summary.not_oriented.push(NotOriented { station: name, reason: error.to_string() }),
        }
    }
    growth.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    summary.findings.extend(worth(&growth));
    let every = growth.len().div_ceil(GROWTH).max(1);
    let last = growth.last().copied();
    let mut shown: Vec<SigmaAtTime> = growth.into_iter().step_by(every).collect();
    shown.extend(last.filter(|last| shown.last().is_some_and(|shown| shown.seconds < last.seconds)));
    let biases = anchors.first().map(|anchor| anchor.biases);
    summary.inertial = biases.map(|biases| InertialSummary {
        start: if known.poses.len() >= SEQUENCE { "sequence" } else { "rest" },
        gyro_bias_rad_s: biases.gyro.into(),
        accel_bias_m_s2: biases.accel.into(),
        growth: shown,
    });
    Ok(Outcome { summary, stations: placed })
}

/// What the unit is worth, in a sentence.
fn worth(growth: &[SigmaAtTime]) -> Option<String> {
    let last = growth.last().filter(|last| last.seconds > 0.0)?;
    Some(format!(
        "by itself the unit knows the position to {:.3} m and the attitude to {:.2} degrees {:.1} s after the last known pose: errors of \
         the position grow with the square of the time and faster",
        last.position_m, last.attitude_deg, last.seconds
    ))
}

/// What the survey names, or `imu.csv` in its folder.
fn read_unit(camera: &SurveyCamera) -> Result<InertialUnit> {
    match read_inertial(&camera.survey, &camera.root)? {
        Some(named) => Ok(named),
        None => InertialUnit::read(&camera.root.join(FILE)),
    }
}

/// States at the known poses.
fn of_sequence(
    camera: &SurveyCamera,
    known: &Known,
    unit: &InertialUnit,
    summary: &mut OrientSummary,
) -> Result<Vec<Anchor>> {
    let poses: Vec<CameraPose> =
        known.poses.iter().map(|TimedPose { time_s, pose }| CameraPose { time_s: *time_s, pose: *pose }).collect();
    let InertialUnit { samples, camera_from_body, noise } = unit;
    let mounting = Mounting::Known(*camera_from_body);
    let options = SequenceOptions { noise: *noise, mounting, ..SequenceOptions::default() };
    let found = estimate_sequence(&poses, samples, &options)
        .map_err(Error::estimation("orientation by an inertial unit", &camera.root))?;
    summary.doubts.extend(found.contradicting.iter().filter_map(|&interval| {
        let [before, after] = [known.names.get(interval)?, known.names.get(interval + 1)?];
        let words = format!(
            "between {before} and {after} the unit measured another motion than their known poses have: its samples there took no part"
        );
        Some(Doubt::about(DoubtKind::Contradiction, after, words))
    }));
    Ok(found.states.iter().map(|state| Anchor::of_state(state, found.gravity, camera_from_body)).collect())
}

fn wrong(message: &str) -> Error {
    Error::Request { command: "orient", message: message.to_owned() }
}
