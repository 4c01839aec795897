//! One step from sample to sample.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use inertial::InertialSample;

use super::options::ImuOptions;
use super::state::{ACCEL_BIAS, ATTITUDE, DISPLACEMENT, GYRO_BIAS, Matrix18, ROTATION, State, VELOCITY};

/// Integrates over one interval: the rate is its mean, the acceleration linear from one end to the other.
pub(super) fn propagate(state: &mut State, from: &InertialSample, to: &InertialSample, options: &ImuOptions) {
    let dt = to.timestamp_s - from.timestamp_s;
    let rate = (from.angular_rate + to.angular_rate) * 0.5 - state.gyro_bias;
    // Between samples the axis turns as well: the first term of the coning correction.
    let coning = from.angular_rate.cross(&to.angular_rate) * (dt * dt / 12.0);
    let turn = UnitQuaternion::from_scaled_axis(rate * dt + coning);
    let mut rotation = state.rotation * turn;
    rotation.renormalize();
    let gravity = state.world_from_start.inverse() * Vector3::new(0.0, 0.0, -options.gravity_m_s2);
    let (force_before, force_after) = (from.specific_force - state.accel_bias, to.specific_force - state.accel_bias);
    let (before, after) = (state.rotation * force_before + gravity, rotation * force_after + gravity);

    let jacobian = jacobian(state, &turn, &rotation, &force_before, &force_after, &gravity, dt);
    state.covariance = jacobian * state.covariance * jacobian.transpose() + noise(options, dt);
    state.symmetrise();

    state.displacement += state.velocity * dt + (before * 2.0 + after) * (dt * dt / 6.0);
    state.velocity += (before + after) * (dt / 2.0);
    state.rotation = rotation;
}

/// How the errors before the step become those after it, to first order.
fn jacobian(
    state: &State,
    turn: &UnitQuaternion<f64>,
    rotation: &UnitQuaternion<f64>,
    force_before: &Vector3<f64>,
    force_after: &Vector3<f64>,
    gravity: &Vector3<f64>,
    dt: f64,
) -> Matrix18 {
    let (r0, r1) = (state.rotation.to_rotation_matrix().into_inner(), rotation.to_rotation_matrix().into_inner());
    let back = turn.inverse().to_rotation_matrix().into_inner();
    let mean = |a: Matrix3<f64>, b: Matrix3<f64>| (a + b) * 0.5;
    // R exp(φ) f = R f − R [f]x φ; at the end φ has turned with the body, and the bias of the rates has worked.
    let by_rotation = -mean(r0 * force_before.cross_matrix(), r1 * force_after.cross_matrix() * back);
    let by_gyro_bias = r1 * force_after.cross_matrix() * (dt / 2.0);
    let by_attitude = gravity.cross_matrix();
    let by_accel_bias = -mean(r0, r1);
    let mut f = Matrix18::identity();
    let mut set = |row: usize, column: usize, block: Matrix3<f64>| {
        f.fixed_view_mut::<3, 3>(row, column).copy_from(&block);
    };
    set(DISPLACEMENT, VELOCITY, Matrix3::identity() * dt);
    set(ROTATION, ROTATION, back);
    set(ROTATION, GYRO_BIAS, -Matrix3::identity() * dt);
    let parts = [
        (ROTATION, by_rotation, 0.5),
        (ATTITUDE, by_attitude, 0.5),
        (GYRO_BIAS, by_gyro_bias, 1.0 / 3.0),
        (ACCEL_BIAS, by_accel_bias, 0.5),
    ];
    for (column, block, share) in parts {
        set(VELOCITY, column, block * dt);
        set(DISPLACEMENT, column, block * (share * dt * dt));
    }
    f
}

/// What the interval adds, from the noise densities; white forces become correlated velocity and displacement.
fn noise(options: &ImuOptions, dt: f64) -> Matrix18 {
    let (gyro, accel) = (options.gyro_noise.powi(2), options.accel_noise.powi(2));
    let mut q = Matrix18::zeros();
    for k in 0..3 {
        q[(DISPLACEMENT + k, DISPLACEMENT + k)] = accel * dt.powi(3) / 3.0;
        q[(DISPLACEMENT + k, VELOCITY + k)] = accel * dt * dt / 2.0;
        q[(VELOCITY + k, DISPLACEMENT + k)] = accel * dt * dt / 2.0;
        q[(VELOCITY + k, VELOCITY + k)] = accel * dt;
        q[(ROTATION + k, ROTATION + k)] = gyro * dt;
        q[(GYRO_BIAS + k, GYRO_BIAS + k)] = options.gyro_walk.powi(2) * dt;
        q[(ACCEL_BIAS + k, ACCEL_BIAS + k)] = options.accel_walk.powi(2) * dt;
    }
    q
}
