//! The relative pose of two stations as an observation.

use adjust::{EvaluationFailure, RigidPose};
use nalgebra::{Isometry3, Matrix3, Matrix6, Vector3, Vector6};

use crate::error::{Error, Result};
use rigid_pose::{InputError, pose_difference, require_length};

/// Residual, and Jacobians by target and source.
type RelativeParts = (Vector6<f64>, Matrix6<f64>, Matrix6<f64>);

/// The residual of a relative pose, and the Jacobians of the model by target and source.
pub(super) fn relative_pose_parts(
    observed: &Isometry3<f64>,
    poses: &[&[f64]],
) -> std::result::Result<RelativeParts, EvaluationFailure> {
    let world_from_target = RigidPose::isometry(poses[0])?;
    let world_from_source = RigidPose::isometry(poses[1])?;
    let model = world_from_target.inverse() * world_from_source;
    let v = pose_difference(&model, observed);
    // Steps [dt world, dtheta own axes] move the relative pose R = Rt^T Rs, t = Rt^T (ts - tt) by
    //   source: dt = Rt^T dts,                 dtheta = dthetas
    //   target: dt = -Rt^T dtt + [t]x dthetat, dtheta = -R^T dthetat
    // and v by minus that, the rotation through the inverse left Jacobian at v: log(exp(-dtheta) exp(v)).
    let turned = inverse_left_jacobian(&v.fixed_rows::<3>(3).into_owned());
    let target_from_world = world_from_target.rotation.inverse().to_rotation_matrix().into_inner();
    let source_from_target = model.rotation.inverse().to_rotation_matrix().into_inner();
    let mut by_target = Matrix6::zeros();
    by_target.fixed_view_mut::<3, 3>(0, 0).copy_from(&-target_from_world);
    by_target.fixed_view_mut::<3, 3>(0, 3).copy_from(&model.translation.vector.cross_matrix());
    by_target.fixed_view_mut::<3, 3>(3, 3).copy_from(&-(turned * source_from_target));
    let mut by_source = Matrix6::zeros();
    by_source.fixed_view_mut::<3, 3>(0, 0).copy_from(&target_from_world);
    by_source.fixed_view_mut::<3, 3>(3, 3).copy_from(&turned);
    Ok((v, by_target, by_source))
}

/// `J⁻¹` with `log(exp(-d) exp(v)) = v - J⁻¹(v) d` to first order in d.
fn inverse_left_jacobian(v: &Vector3<f64>) -> Matrix3<f64> {
    let angle = v.norm();
    let cross = v.cross_matrix();
    // The factor tends to 1/12; below a hundredth of a radian its next term, angle² / 720, is under 1e-6 of it.
    let factor = if angle < 1e-2 {
        1.0 / 12.0 + angle * angle / 720.0
    } else {
        1.0 / (angle * angle) - (1.0 + angle.cos()) / (2.0 * angle * angle.sin())
    };
    Matrix3::identity() - 0.5 * cross + factor * cross * cross
}

pub(super) fn require_poses(stations: usize, poses: &[Isometry3<f64>]) -> Result<()> {
    if stations == 0 {
        return Err(InputError::Empty { what: "the list of stations" }.into());
    }
    Ok(require_length("poses of the stations", stations, poses.len())?)
}

#[allow(clippy::needless_pass_by_value)] // the form that map_err takes
pub(super) fn adjustment(error: adjust::Error) -> Error {
    Error::Adjustment(error.to_string())
}

#[cfg(test)]
#[path = "../tests/inside/relative_pose.rs"]
mod tests;
