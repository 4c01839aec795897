//! What is known of the body's motion since the last frame.

use nalgebra::{Isometry3, SMatrix, UnitQuaternion, Vector3};

/// Covariance of the errors, three components each: displacement and velocity (start axes), rotation (body axes),
/// attitude at the start (start axes), bias of the rates, bias of the forces.
pub(super) type Matrix18 = SMatrix<f64, 18, 18>;

pub(super) const DISPLACEMENT: usize = 0;
pub(super) const ROTATION: usize = 3;
pub(super) const VELOCITY: usize = 6;
pub(super) const ATTITUDE: usize = 9;
pub(super) const GYRO_BIAS: usize = 12;
pub(super) const ACCEL_BIAS: usize = 15;

/// The motion since the last frame, in the axes the body had then ("start").
#[derive(Debug, Clone)]
pub(super) struct State {
    pub(super) displacement: Vector3<f64>,
    pub(super) rotation: UnitQuaternion<f64>,
    pub(super) velocity: Vector3<f64>,
    /// World: z up, heading that of the body at rest.
    pub(super) world_from_start: UnitQuaternion<f64>,
    pub(super) gyro_bias: Vector3<f64>,
    pub(super) accel_bias: Vector3<f64>,
    pub(super) covariance: Matrix18,
}

impl State {
    pub(super) fn start_from_body(&self) -> Isometry3<f64> {
        Isometry3::from_parts(self.displacement.into(), self.rotation)
    }

    /// Counts from the body's present axes.
    pub(super) fn rebase(&mut self) {
        let back = self.rotation.inverse().to_rotation_matrix().into_inner();
        self.velocity = back * self.velocity;
        self.world_from_start *= self.rotation;
        self.world_from_start.renormalize();
        (self.displacement, self.rotation) = (Vector3::zeros(), UnitQuaternion::identity());
        // R0 exp(θ) R exp(φ) = R0 R exp(Rᵀθ + φ); exp(-φ) Rᵀ (v + dv) = v' + Rᵀ dv + [v']x φ.
        let mut jacobian = Matrix18::identity();
        jacobian.fixed_view_mut::<6, 6>(0, 0).fill(0.0);
        jacobian.fixed_view_mut::<3, 3>(VELOCITY, VELOCITY).copy_from(&back);
        jacobian.fixed_view_mut::<3, 3>(VELOCITY, ROTATION).copy_from(&self.velocity.cross_matrix());
        jacobian.fixed_view_mut::<3, 3>(ATTITUDE, ATTITUDE).copy_from(&back);
        jacobian.fixed_view_mut::<3, 3>(ATTITUDE, ROTATION).fill_with_identity();
        self.covariance = jacobian * self.covariance * jacobian.transpose();
        self.symmetrise();
    }

    pub(super) fn symmetrise(&mut self) {
        self.covariance = (self.covariance + self.covariance.transpose()) * 0.5;
    }
}
