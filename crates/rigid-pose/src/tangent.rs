//! Small steps of a pose, and the order of the six numbers in every covariance of a pose.
//!
//! Tangent of a pose `a_from_b`: `[dt, dtheta]`, `dt` in metre along the axes of frame a, `dtheta` in radian about the
//! axes of frame b: `t ← t + dt`, `R ← R exp(dtheta)`.

use nalgebra::{Isometry3, Matrix6, Translation3, UnitQuaternion, Vector3, Vector6};

/// Adds a tangent step `[dt, dtheta]` to a pose.
#[must_use]
pub fn step_pose(a_from_b: &Isometry3<f64>, step: &Vector6<f64>) -> Isometry3<f64> {
    let translation = a_from_b.translation.vector + Vector3::new(step[0], step[1], step[2]);
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(step[3], step[4], step[5]));
    let mut rotation = a_from_b.rotation * turn;
    rotation.renormalize();
    Isometry3::from_parts(Translation3::from(translation), rotation)
}

/// The tangent step that leads from pose `from` to pose `to`: `step_pose(from, &pose_difference(from, to)) = to`.
#[must_use]
pub fn pose_difference(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    let dt = to.translation.vector - from.translation.vector;
    let dtheta = (from.rotation.inverse() * to.rotation).scaled_axis();
    Vector6::new(dt.x, dt.y, dt.z, dtheta.x, dtheta.y, dtheta.z)
}

/// Covariance of `b_from_a` from that of `a_from_b`, both in their own tangents.
#[must_use]
pub fn inverse_covariance_transport(a_from_b: &Isometry3<f64>, covariance: &Matrix6<f64>) -> Matrix6<f64> {
    // b_from_a has translation -R^T t and rotation R^T. With t + dt and R exp(w): its translation moves by
    // -R^T dt - [R^T t]x w (since exp(-w) p = p + [p]x w for p = -R^T t), its rotation exp(-w) R^T = R^T exp(-R w).
    let r = a_from_b.rotation.to_rotation_matrix().into_inner();
    let rt_t = r.transpose() * a_from_b.translation.vector;
    let mut jacobian = Matrix6::zeros();
    jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&-r.transpose());
    jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&-rt_t.cross_matrix());
    jacobian.fixed_view_mut::<3, 3>(3, 3).copy_from(&-r);
    symmetrised(&(jacobian * covariance * jacobian.transpose()))
}

/// Takes rounding off a matrix that is symmetric by construction.
#[must_use]
pub fn symmetrised(m: &Matrix6<f64>) -> Matrix6<f64> {
    (m + m.transpose()) * 0.5
}
