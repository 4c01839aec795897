//! Stations by an inertial unit alone, from poses that are known.

use std::path::Path;

use commands::{Doubt, DoubtKind, InertialUnit, read_inertial};
use inertial::{CameraPose, ImuNoise, InertialState, Mounting, SequenceOptions, estimate_sequence};
use orientation::TimedPose;
use pipeline::survey::StationPose;
use pipeline::{Error, Result};
use rigid_pose::Uncertain;

use crate::camera::SurveyCamera;
use crate::known::Known;
use crate::outcome::{Outcome, Placed};
use crate::summary::{InertialSummary, NotOriented, OrientSummary, SigmaAtTime};

/// Taken where the survey names no data.
const FILE: &str = "imu.csv";
/// Known poses from which on velocities and biases come from their sequence.
const SEQUENCE: usize = 4;
/// Lines of the table that says how well a pose is known after how long.
const GROWTH: usize = 12;

pub(crate) fn orient(camera: &SurveyCamera, known: Option<&Path>) -> Result<Outcome> {
    let mut unit = read_unit(camera)?;
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
    let states = if known.poses.len() >= SEQUENCE {
        of_sequence(camera, &known, &mut unit, &mut summary)?
    } else {
        let first = known.poses.first().copied();
        let first = first.ok_or_else(|| wrong("no pose is known to begin with"))?;
        let world_from_body = first.pose.then(&Uncertain::exact(unit.camera_from_body));
        let start = InertialState::at_rest(&unit.samples, first.time_s, &world_from_body, &unit.noise).map_err(|error| {
            wrong(&format!(
                "before the first known pose (at {} s) {error}; four known poses give velocity and biases without a rest, and if the \
                 clocks differ, shift one",
                first.time_s
            ))
        })?;
        vec![start]
    };
    summary.findings.extend(known.assumed());
    let InertialUnit { samples, camera_from_body, noise } = &unit;
    let (mut placed, mut growth) = (Vec::new(), Vec::new());
    for (name, time_s) in stations {
        let before = states.partition_point(|state| state.time_s <= time_s);
        let Some(state) = before.checked_sub(1).and_then(|index| states.get(index)) else {
            let reason = format!("its time, {time_s} s, lies before the first known pose");
            summary.not_oriented.push(NotOriented { station: name, reason });
            continue;
        };
        match state.carried(samples, time_s, noise) {
            Ok(body) => {
                let found = body.pose().then(&Uncertain::exact(camera_from_body.inverse()));
                let pose = StationPose { world_from_camera: found.pose, covariance: Some(found.covariance) };
                let station = Placed::new(&name, Some(time_s), pose);
                if let Some([position_m, attitude_deg]) = station.sigmas() {
                    growth.push(SigmaAtTime { seconds: time_s - state.time_s, position_m, attitude_deg });
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
    let biases = states.first().map(|state| state.biases);
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

/// States at the known poses. The unit has the noise that they show it to have afterwards.
fn of_sequence(
    camera: &SurveyCamera,
    known: &Known,
    unit: &mut InertialUnit,
    summary: &mut OrientSummary,
) -> Result<Vec<InertialState>> {
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
    summary.findings.extend(noisier(noise, &found.noise));
    let states = (0..found.states.len()).filter_map(|pose| found.state_of_body(pose)).collect();
    unit.noise = found.noise;
    Ok(states)
}

/// By how much a unit is noisier than it is said to be, in a sentence.
fn noisier(stated: &ImuNoise, found: &ImuNoise) -> Option<String> {
    let times = [found.gyro_density / stated.gyro_density, found.accel_density / stated.accel_density];
    let of = |times: f64, what: &str| (times > 1.0).then(|| format!("{what} {times:.1} times"));
    let words: Vec<String> = [of(times[0], "rates"), of(times[1], "forces")].into_iter().flatten().collect();
    let words = words.join(" and ");
    (!words.is_empty()).then(|| {
        format!("between the known poses the unit is noisier than it is said to be ({words}): deviations are stated with that")
    })
}

fn wrong(message: &str) -> Error {
    Error::Request { command: "orient", message: message.to_owned() }
}
