//! The relative pose of two stations as an observation.

use nalgebra::{Dyn, Isometry3, Matrix6, OMatrix, U6, Vector6};

use crate::error::Result;
use rigid_pose::{InputError, inverse_left_jacobian, is_finite, pose_difference, relative_jacobians, require_length};

/// Rows of some observations by the pose of a station.
pub(super) type Rows = OMatrix<f64, Dyn, U6>;

/// A relative pose of two stations that is observed along some motions.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RelativePose {
    pub stations: [usize; 2],
    /// The second in the frame of the first.
    pub first_from_second: Isometry3<f64>,
    /// The motions, by the tangent of that pose, each over its standard deviation.
    pub rows: Rows,
}

/// The residual of a relative pose, and the Jacobians of the model by target and source.
pub(super) fn relative_pose_parts(
    observed: &Isometry3<f64>,
    world_from_target: &Isometry3<f64>,
    world_from_source: &Isometry3<f64>,
) -> (Vector6<f64>, [Matrix6<f64>; 2]) {
    let model = world_from_target.inverse() * world_from_source;
    let v = pose_difference(&model, observed);
    // v moves by minus what the model moves by, the rotation through the inverse left Jacobian at v: log(exp(-dtheta) exp(v)).
    let turned = inverse_left_jacobian(&v.fixed_rows::<3>(3).into_owned());
    let by = relative_jacobians(world_from_target, &model).map(|mut by| {
        let turns = turned * by.fixed_rows::<3>(3);
        by.fixed_rows_mut::<3>(3).copy_from(&turns);
        by
    });
    (v, by)
}

/// Refuses other than one finite pose for each of some stations, or frames.
pub(super) fn check_poses(what: &'static str, stations: usize, poses: &[Isometry3<f64>]) -> Result<()> {
    require_length(what, stations, poses.len())?;
    match poses.iter().position(|pose| !is_finite(pose)) {
        Some(index) => Err(InputError::NonFinite { what, index }.into()),
        None => Ok(()),
    }
}

#[cfg(test)]
#[path = "../tests/inside/relative_pose.rs"]
mod tests;
