//! One step from sample to sample.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::noise::{Biases, ImuNoise};
use crate::preintegrated::{Matrix9, Matrix9x6, POSITION, ROTATION, VELOCITY};
use crate::sample::InertialSample;
use rigid_pose::left_jacobian;

/// Motion in the axes that the body had at the start, free of gravity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Motion {
    pub(crate) rotation: UnitQuaternion<f64>,
    pub(crate) velocity: Vector3<f64>,
    pub(crate) position: Vector3<f64>,
}

/// A step and its derivatives.
pub(crate) struct Step {
    pub(crate) motion: Motion,
    /// By the errors before.
    pub(crate) by_motion: Matrix9,
    /// By the biases.
    pub(crate) by_biases: Matrix9x6,
    /// What the interval adds.
    pub(crate) noise: Matrix9,
}

/// Integrates over one interval: the rate is its mean, the acceleration linear from one end to the other.
pub(crate) fn step(
    motion: &Motion,
    from: &InertialSample,
    to: &InertialSample,
    biases: &Biases,
    noise: &ImuNoise,
) -> Step {
    let dt = to.timestamp_s - from.timestamp_s;
    let rate = (from.angular_rate + to.angular_rate) * 0.5 - biases.gyro;
    // Between samples the axis turns as well: the first term of the coning correction.
    let coning = from.angular_rate.cross(&to.angular_rate) * (dt * dt / 12.0);
    let theta = rate * dt + coning;
    let turn = UnitQuaternion::from_scaled_axis(theta);
    let mut rotation = motion.rotation * turn;
    rotation.renormalize();
    let [before, after] = [from, to].map(|sample| sample.specific_force - biases.accel);
    let (r0, r1) = (motion.rotation.to_rotation_matrix().into_inner(), rotation.to_rotation_matrix().into_inner());
    let (a0, a1) = (r0 * before, r1 * after);

    let back = turn.inverse().to_rotation_matrix().into_inner();
    let by_gyro = -left_jacobian(&theta).transpose() * dt;
    // R exp(φ) f = R f − R [f]x φ; at the end φ has turned with the body, and the bias of the rates has worked.
    let (c0, c1) = (-r0 * before.cross_matrix(), -r1 * after.cross_matrix());
    // Weights of both ends in the velocity, and in the position.
    let (v0, v1, p0, p1) = (dt / 2.0, dt / 2.0, dt * dt / 3.0, dt * dt / 6.0);
    let mut by_motion = Matrix9::identity();
    let mut set = |row: usize, column: usize, block: Matrix3<f64>| {
        by_motion.fixed_view_mut::<3, 3>(row, column).copy_from(&block);
    };
    set(ROTATION, ROTATION, back);
    set(VELOCITY, ROTATION, c0 * v0 + c1 * back * v1);
    set(POSITION, ROTATION, c0 * p0 + c1 * back * p1);
    set(POSITION, VELOCITY, Matrix3::identity() * dt);
    let mut by_biases = Matrix9x6::zeros();
    let mut set = |row: usize, column: usize, block: Matrix3<f64>| {
        by_biases.fixed_view_mut::<3, 3>(row, column).copy_from(&block);
    };
    set(ROTATION, 0, by_gyro);
    set(VELOCITY, 0, c1 * by_gyro * v1);
    set(POSITION, 0, c1 * by_gyro * p1);
    set(VELOCITY, 3, -(r0 * v0 + r1 * v1));
    set(POSITION, 3, -(r0 * p0 + r1 * p1));
    Step {
        motion: Motion {
            rotation,
            velocity: motion.velocity + a0 * v0 + a1 * v1,
            position: motion.position + motion.velocity * dt + a0 * p0 + a1 * p1,
        },
        by_motion,
        by_biases,
        noise: white(noise, dt),
    }
}

/// Noise of an interval from the densities; white forces become correlated velocity and position.
fn white(noise: &ImuNoise, dt: f64) -> Matrix9 {
    let (gyro, accel) = (noise.gyro_density.powi(2), noise.accel_density.powi(2));
    let mut q = Matrix9::zeros();
    for k in 0..3 {
        q[(ROTATION + k, ROTATION + k)] = gyro * dt;
        q[(VELOCITY + k, VELOCITY + k)] = accel * dt;
        q[(VELOCITY + k, POSITION + k)] = accel * dt * dt / 2.0;
        q[(POSITION + k, VELOCITY + k)] = accel * dt * dt / 2.0;
        q[(POSITION + k, POSITION + k)] = accel * dt.powi(3) / 3.0;
    }
    q
}
