//! Stations by the poses of what carries the camera.

mod slips;

use camera_model::with_computer_vision_axes;
use commands::{Doubt, DoubtKind};
use nalgebra::{Matrix3, Vector3};
use orientation::{LeverArm, Mounting, MountingOptions, TimeOffset, TimedPose, estimate_mounting};
use pipeline::survey::StationPose;
use pipeline::{Error, Result};
use range_io::trajectory::{StampedPose, read_any_trajectory};
use rigid_pose::Uncertain;
use statistics::chi_squared_limit;

use crate::camera::SurveyCamera;
use crate::known::{Known, covariance};
use crate::outcome::{Outcome, Placed};
use crate::request::TrackerOptions;
use crate::summary::{MountingSummary, NotOriented, OrientSummary, RejectedValue};

/// Standard deviation of a lever arm that is given, metre: a drawing and a ruler.
const LEVER_ARM_SIGMA_M: f64 = 0.005;
/// Level of the test of all residuals.
const LEVEL: f64 = 0.001;

pub(crate) fn orient(camera: &SurveyCamera, options: &TrackerOptions) -> Result<Outcome> {
    let stations = camera.timed_stations()?;
    let carrier = read_carrier(options)?;
    let known = Known::read(camera, options.known.as_deref())?;
    let mounting_options = mounting_options(options);
    slips::require_common_time(&options.poses, &carrier, &known, options)?;
    let mounting = estimate_mounting(&carrier, &known.poses, &mounting_options)
        .map_err(|error| slips::explained(&options.poses, &carrier, &known, &mounting_options, error))?;
    let mut summary = summary(&mounting, &known);
    let mut placed = Vec::new();
    for (name, time_s) in stations {
        match mounting.camera_at(&carrier, time_s, options.longest_gap_s) {
            Some(Uncertain { pose, covariance }) => {
                let pose = StationPose { world_from_camera: pose, covariance: Some(covariance) };
                placed.push(Placed::new(&name, Some(time_s), pose));
            }
            None => summary.not_oriented.push(NotOriented {
                station: name,
                reason: format!(
                    "the tracker has no poses around its time, {time_s} s, at most {} s apart (--longest-gap)",
                    options.longest_gap_s
                ),
            }),
        }
    }
    Ok(Outcome { summary, stations: placed })
}

/// The carrier's poses in the axes of the file.
fn read_carrier(options: &TrackerOptions) -> Result<Vec<TimedPose>> {
    let covariance = covariance(options.sigma_position_m, options.sigma_attitude_rad);
    let timed = |pose: StampedPose| {
        // Readers of trajectories turn the axes of a camera; a tracker's body has those of its file.
        let pose_in_file = with_computer_vision_axes(&pose.world_from_camera);
        TimedPose { time_s: pose.timestamp_s, pose: Uncertain { pose: pose_in_file, covariance } }
    };
    let carrier: Vec<TimedPose> = read_any_trajectory(&options.poses)?.into_iter().map(timed).collect();
    if let Some(index) = carrier.windows(2).position(|pair| pair[1].time_s <= pair[0].time_s) {
        let message = format!(
            "{}: the time of pose {} is not later than that of the one before",
            options.poses.display(),
            index + 1
        );
        return Err(Error::Request { command: "orient", message });
    }
    Ok(carrier)
}

fn mounting_options(options: &TrackerOptions) -> MountingOptions {
    let lever_arm = options.lever_arm_m.map(|vector| LeverArm {
        vector: Vector3::from(vector),
        covariance: Matrix3::identity() * LEVER_ARM_SIGMA_M.powi(2),
    });
    MountingOptions {
        time_offset: options.time_offset_within_s.map_or(TimeOffset::Known(0.0), TimeOffset::Within),
        lever_arm,
        max_gap_s: options.longest_gap_s,
        ..MountingOptions::default()
    }
}

fn summary(mounting: &Mounting, known: &Known) -> OrientSummary {
    let mut summary = OrientSummary { datum: "the frame of the known stations".to_owned(), ..OrientSummary::default() };
    summary.findings.extend(known.assumed());
    let of_carrier = &mounting.carrier_from_camera;
    let sigma = |axis: usize| of_carrier.covariance[(axis, axis)].max(0.0).sqrt();
    let turn = of_carrier.covariance.fixed_view::<3, 3>(3, 3).trace().max(0.0).sqrt();
    summary.mounting = Some(MountingSummary {
        lever_arm_m: of_carrier.pose.translation.vector.into(),
        lever_arm_sigma_m: [sigma(0), sigma(1), sigma(2)],
        boresight_deg: of_carrier.pose.rotation.scaled_axis().map(f64::to_degrees).into(),
        boresight_sigma_deg: turn.to_degrees(),
        time_offset_s: mounting.time_offset_s,
        known_stations: mounting.residuals.len() - mounting.gross_errors.len(),
        redundancy: mounting.redundancy,
        sigma0: mounting.sigma0,
    });
    let name = |index: &usize| known.names.get(*index).cloned().unwrap_or_default();
    for index in &mounting.gross_errors {
        let station = name(index);
        let off = mounting.residuals.iter().find(|residual| residual.index == *index);
        let off = off.map_or_else(String::new, |off| {
            format!(" by {:.3} m and {:.2} degrees", off.shift_m.norm(), off.turn_rad.norm().to_degrees())
        });
        let words = format!(
            "its known pose and the tracker's contradict the others{off}: it took no part, and its pose is that of the tracker, \
             which may be the wild one"
        );
        summary.doubts.push(Doubt::about(DoubtKind::Contradiction, &station, words));
        summary.rejected.push(RejectedValue { station, target: String::new(), part: "pose", line: 0 });
    }
    let uncovered: Vec<String> = mounting.uncovered.iter().map(name).collect();
    if !uncovered.is_empty() {
        let words = format!("known stations outside the tracker's trajectory took no part: {}", uncovered.join(", "));
        summary.findings.push(words);
    }
    if let Some(sigma0) = mounting.sigma0.filter(|_| mounting.redundancy > 0) {
        let redundancy = mounting.redundancy as f64;
        let limit = (chi_squared_limit(redundancy, LEVEL) / redundancy).sqrt();
        if sigma0 > limit {
            let words = format!(
                "poses of the tracker and known ones scatter {sigma0:.1} times as much as stated (by chance up to {limit:.2}): state \
                 their standard deviations, or check the clocks (--time-offset-within)"
            );
            summary.doubts.push(Doubt::new(DoubtKind::Contradiction, words));
        }
    }
    summary
}
