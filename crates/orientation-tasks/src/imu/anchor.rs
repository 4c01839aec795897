//! A moment whose state is known, and where the unit leads from there.

use inertial::{Biases, ImuNoise, InertialSample, NavigationState, Preintegrated, SequenceState, StateCovariance};
use nalgebra::{Isometry3, Matrix3, SMatrix, Vector3};
use rigid_pose::{Uncertain, product_jacobians, symmetrised};

/// Places in a state.
pub(crate) const VELOCITY: usize = 6;
pub(crate) const GYRO: usize = 9;
pub(crate) const ACCEL: usize = 12;
pub(crate) const GRAVITY: usize = 15;

/// State of the unit's body at a moment, with everything that its way on depends on.
#[derive(Debug, Clone)]
pub(crate) struct Anchor {
    pub(crate) time_s: f64,
    pub(crate) state: NavigationState,
    pub(crate) biases: Biases,
    pub(crate) gravity: Vector3<f64>,
    /// Of `[dt (world), dθ (body), velocity, gyro bias, accel bias, gravity]`, three each.
    pub(crate) covariance: StateCovariance,
}

impl Anchor {
    /// Of a sequence, with the correlations of its pose, velocity, biases and gravity.
    pub(crate) fn of_state(state: &SequenceState, gravity: Vector3<f64>, camera_from_body: &Isometry3<f64>) -> Self {
        let camera = &state.world_from_camera.pose;
        let mut to_body = StateCovariance::identity();
        to_body.fixed_view_mut::<6, 6>(0, 0).copy_from(&product_jacobians(camera, camera_from_body).0);
        let covariance = to_body * state.covariance * to_body.transpose();
        let navigation = NavigationState { world_from_body: camera * camera_from_body, velocity: state.velocity };
        Self { time_s: state.time_s, state: navigation, biases: state.biases, gravity, covariance }
    }

    /// `world_from_camera` at a later time, by the unit alone.
    ///
    /// Biases walk meanwhile: that counts as a constant bias whose variance is a third of the walk's at the end, which is what the
    /// attitude sees of it, and more than the position does.
    ///
    /// # Errors
    /// Where samples are missing.
    pub(crate) fn camera_at(
        &self,
        samples: &[InertialSample],
        time_s: f64,
        camera_from_body: &Isometry3<f64>,
        noise: &ImuNoise,
    ) -> Result<Uncertain, inertial::Error> {
        let camera = |body: Uncertain| body.then(&Uncertain::exact(camera_from_body.inverse()));
        if time_s <= self.time_s {
            let covariance = self.covariance.fixed_view::<6, 6>(0, 0).into_owned();
            return Ok(camera(Uncertain { pose: self.state.world_from_body, covariance }));
        }
        let motion = Preintegrated::new(samples, [self.time_s, time_s], &self.biases, noise)?;
        let end = motion.predict(&self.state, &self.gravity, &self.biases);
        let (_, by) = motion.residual_with_jacobians(&self.state, &end, &self.gravity, &self.biases);
        let mut by_state = SMatrix::<f64, 9, 18>::zeros();
        by_state.fixed_view_mut::<9, 6>(0, 0).copy_from(&by.start_pose);
        by_state.fixed_view_mut::<9, 3>(0, VELOCITY).copy_from(&by.start_velocity);
        by_state.fixed_view_mut::<9, 6>(0, GYRO).copy_from(&by.biases);
        by_state.fixed_view_mut::<9, 3>(0, GRAVITY).copy_from(&by.gravity);
        let mut state = self.covariance;
        for axis in 0..3 {
            state[(GYRO + axis, GYRO + axis)] += noise.gyro_walk.powi(2) * motion.seconds / 3.0;
            state[(ACCEL + axis, ACCEL + axis)] += noise.accel_walk.powi(2) * motion.seconds / 3.0;
        }
        let residual = by_state * state * by_state.transpose() + motion.covariance;
        // The residual is zero at the end: its derivative by the end's attitude is one, by its position the way back.
        let rotation = self.state.world_from_body.rotation.to_rotation_matrix().into_inner();
        let mut by_residual = SMatrix::<f64, 6, 9>::zeros();
        by_residual.fixed_view_mut::<3, 3>(0, 6).copy_from(&rotation);
        by_residual.fixed_view_mut::<3, 3>(3, 0).copy_from(&Matrix3::identity());
        let covariance = symmetrised(&(by_residual * residual * by_residual.transpose()));
        Ok(camera(Uncertain { pose: end.world_from_body, covariance }))
    }
}
