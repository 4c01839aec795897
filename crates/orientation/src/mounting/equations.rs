//! The observation equations of one pose.

use adjust::{EvaluationFailure, Parameters, Real, ResidualFunction};
use nalgebra::{Isometry3, Matrix6, Vector3};
use rigid_pose::{Uncertain, product_jacobians, symmetrised};

use crate::mounting::carrier::Span;

/// What the camera saw at one moment: `target_from_camera = world_from_target⁻¹ · world_from_carrier · carrier_from_camera`.
/// Blocks: `carrier_from_camera`, `world_from_target`, time offset (second).
#[derive(Debug, Clone, Copy)]
pub(crate) struct PoseEquations {
    /// The carrier around that moment, by the offset of the guess.
    pub(crate) span: Span,
    pub(crate) time_s: f64,
    pub(crate) target_from_camera: Isometry3<f64>,
}

type Triple<T> = [T; 3];

impl ResidualFunction<6> for PoseEquations {
    fn residual<T: Real>(&self, parameters: &Parameters<'_, T>) -> Result<[T; 6], EvaluationFailure> {
        let (mounting, target, [offset]) = (parameters.pose(0)?, parameters.pose(1)?, parameters.values(2)?);
        let span = &self.span;
        let since = offset + (self.time_s - span.start_s);
        let rotation = span.start.rotation.to_rotation_matrix().into_inner();
        let turned = |vector: Triple<T>| {
            let turned = turn(&span.rate, since, vector);
            let row =
                |i: usize| turned[0] * rotation[(i, 0)] + turned[1] * rotation[(i, 1)] + turned[2] * rotation[(i, 2)];
            [row(0), row(1), row(2)]
        };
        let lever_arm = turned(mounting.translation());
        let start = span.start.translation.vector;
        let place = |i: usize| lever_arm[i] + since * span.velocity[i] + start[i];
        let model = target.inverse_transform([place(0), place(1), place(2)]);
        let observed = self.target_from_camera;
        let shift = |i: usize| -model[i] + observed.translation.vector[i];
        // Σ m × o / 2 over the axes is the sine of the rotation from model to observed.
        let mut turn = [T::from(0.0); 3];
        for axis in 0..3 {
            let unit = Vector3::from_fn(|k, _| f64::from(u8::from(k == axis)));
            let m = target.inverse_rotate(turned(mounting.rotate([unit.x, unit.y, unit.z].map(T::from))));
            let o = observed.rotation * unit;
            let cross = [m[1] * o.z - m[2] * o.y, m[2] * o.x - m[0] * o.z, m[0] * o.y - m[1] * o.x];
            turn = std::array::from_fn(|k| turn[k] + cross[k] * 0.5);
        }
        let axes = observed.rotation.to_rotation_matrix().into_inner();
        let in_camera = |k: usize| turn[0] * axes[(0, k)] + turn[1] * axes[(1, k)] + turn[2] * axes[(2, k)];
        Ok([shift(0), shift(1), shift(2), in_camera(0), in_camera(1), in_camera(2)])
    }
}

/// A vector turned by a rate (radian per second) for a time.
fn turn<T: Real>(rate: &Vector3<f64>, seconds: T, vector: Triple<T>) -> Triple<T> {
    let speed = rate.norm();
    if speed <= 0.0 {
        return vector;
    }
    let axis = rate / speed;
    let angle = seconds * speed;
    let (sine, cosine) = (angle.sin(), angle.cos());
    let along = (vector[0] * axis.x + vector[1] * axis.y + vector[2] * axis.z) * (-cosine + 1.0);
    let across = [
        vector[2] * axis.y - vector[1] * axis.z,
        vector[0] * axis.z - vector[2] * axis.x,
        vector[1] * axis.x - vector[0] * axis.y,
    ];
    std::array::from_fn(|k| vector[k] * cosine + across[k] * sine + along * axis[k])
}

/// Covariance of the observed pose and of the carrier's together, tangent of the former.
pub(crate) fn covariance(
    carrier: &Uncertain,
    camera: &Uncertain,
    carrier_from_camera: &Isometry3<f64>,
    world_from_target: &Isometry3<f64>,
) -> Matrix6<f64> {
    let (by_carrier, _) = product_jacobians(&carrier.pose, carrier_from_camera);
    let (_, by_camera) = product_jacobians(&world_from_target.inverse(), &(carrier.pose * carrier_from_camera));
    let jacobian = by_camera * by_carrier;
    symmetrised(&(camera.covariance + jacobian * carrier.covariance * jacobian.transpose()))
}

/// A lever arm that is known before.
#[derive(Debug, Clone, Copy)]
pub(crate) struct KnownLeverArm(pub(crate) Vector3<f64>);

impl ResidualFunction<3> for KnownLeverArm {
    fn residual<T: Real>(&self, parameters: &Parameters<'_, T>) -> Result<[T; 3], EvaluationFailure> {
        let lever_arm = parameters.pose(0)?.translation();
        Ok(std::array::from_fn(|k| -lever_arm[k] + self.0[k]))
    }
}
