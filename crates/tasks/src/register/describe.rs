//! Results in words and figures that a reader understands without the program.

use icp_registration::{MotionKind, UndeterminedMotion};
use multiview_registration::{Placement, StationPlacement};
use nalgebra::Isometry3;
use pipeline::stations::Station;
use pipeline::survey::StationPose;

use crate::register::summary::{RegisterSummary, RegisteredPlacement, RegisteredStation};

/// A motion that the surfaces leave open, axes in the target's frame.
pub(crate) fn motion(motion: &UndeterminedMotion) -> String {
    let [x, y, z]: [f64; 3] = motion.axis.into();
    let [a, b, c]: [f64; 3] = motion.through.coords.into();
    let kind = match motion.kind {
        MotionKind::Translation => format!("sliding along ({x:.2}, {y:.2}, {z:.2})"),
        MotionKind::Rotation => format!("turning about ({x:.2}, {y:.2}, {z:.2}) through ({a:.2}, {b:.2}, {c:.2}) m"),
    };
    if motion.sigma_m.is_finite() {
        format!("{kind}, sigma {:.0} mm", 1e3 * motion.sigma_m)
    } else {
        format!("{kind}, which nothing holds")
    }
}

/// How a station agrees with the others; `None` where that was not judged.
pub(crate) fn placement(found: &StationPlacement) -> Option<RegisteredPlacement> {
    let verdict = match found.verdict {
        Placement::Placed => "placed",
        Placement::Doubtful => "doubtful",
        Placement::Unjudged => return None,
    };
    Some(RegisteredPlacement { verdict, contradicting: found.share(), times_usual: found.times_usual })
}

/// The rows of all stations; errors where the truth is known, in the frame in which the first station is right.
pub(crate) fn stations(
    stations: &[Station],
    poses: &[StationPose],
    points: &[usize],
    mut undetermined: Vec<Vec<String>>,
) -> Vec<RegisteredStation> {
    undetermined.resize(stations.len(), Vec::new());
    let truth_from_common = stations.iter().zip(poses).find_map(|(station, pose)| {
        station.truth.map(|truth: Isometry3<f64>| truth * pose.world_from_camera.inverse())
    });
    let row = |(((station, pose), points), undetermined): (((&Station, &StationPose), &usize), Vec<String>)| {
        let errors = station.truth.zip(truth_from_common).map(|(truth, truth_from_common)| {
            let estimate = truth_from_common * pose.world_from_camera;
            let position = (estimate.translation.vector - truth.translation.vector).norm();
            (position, estimate.rotation.angle_to(&truth.rotation).to_degrees())
        });
        let known = pose.covariance.filter(|covariance| covariance.trace() > 0.0);
        RegisteredStation {
            name: station.name.clone(),
            points: *points,
            position_m: pose.world_from_camera.translation.vector.into(),
            attitude_deg: camera_model::euler_from_pose(&pose.world_from_camera).map(f64::to_degrees),
            position_sigma_m: known.and_then(|_| pose.position_sigma_m()),
            attitude_sigma_deg: known.map(|c| (c[(3, 3)] + c[(4, 4)] + c[(5, 5)]).sqrt().to_degrees()),
            position_error_m: errors.map(|errors| errors.0),
            attitude_error_deg: errors.map(|errors| errors.1),
            undetermined,
            placement: None,
        }
    };
    stations.iter().zip(poses).zip(points).zip(undetermined).map(row).collect()
}

/// Fills the largest figures from the rows of the stations.
pub(crate) fn extremes(summary: &mut RegisterSummary) {
    let largest =
        |pick: fn(&RegisteredStation) -> Option<f64>| summary.stations.iter().filter_map(pick).max_by(f64::total_cmp);
    let position_sigma = largest(|station| station.position_sigma_m);
    let position_error = largest(|station| station.position_error_m);
    let attitude_error = largest(|station| station.attitude_error_deg);
    summary.position_sigma_max_m = position_sigma;
    summary.position_error_max_m = position_error;
    summary.attitude_error_max_deg = attitude_error;
}

/// What fixes the common frame.
pub(crate) fn datum(first: &Station, has_poses: bool) -> String {
    if has_poses {
        format!("station {} held at its start pose", first.name)
    } else {
        format!("the frame of {}", first.name)
    }
}
