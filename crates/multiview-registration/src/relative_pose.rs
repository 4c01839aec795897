//! The relative pose of two stations as an observation.

use nalgebra::{Isometry3, Matrix3, Matrix6, Vector3, Vector6};

use crate::error::Result;
use rigid_pose::{InputError, is_finite, pose_difference, require_length};

/// The residual of a relative pose, and the Jacobians of the model by target and source.
pub(super) fn relative_pose_parts(
    observed: &Isometry3<f64>,
    world_from_target: &Isometry3<f64>,
    world_from_source: &Isometry3<f64>,
) -> (Vector6<f64>, [Matrix6<f64>; 2]) {
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
    (v, [by_target, by_source])
}

/// How the relative pose of two stations moves with their poses: Jacobians by target and by source.
pub(crate) fn relative_jacobians(target: &Isometry3<f64>, source: &Isometry3<f64>) -> [Matrix6<f64>; 2] {
    relative_pose_parts(&(target.inverse() * source), target, source).1
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
