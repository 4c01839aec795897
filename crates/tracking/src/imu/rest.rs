//! The state of a body at rest: attitude from gravity, bias of the rates from their mean.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::check_samples;
use inertial::InertialSample;

use super::options::ImuOptions;
use super::state::{ACCEL_BIAS, ATTITUDE, GYRO_BIAS, Matrix18, State, VELOCITY};
use crate::error::{Error, Result};

/// Velocity that a body said to rest may have, metre per second.
const RESTING_VELOCITY: f64 = 1e-3;

pub(super) fn at_rest(samples: &[InertialSample], options: &ImuOptions) -> Result<(State, InertialSample)> {
    check_samples(samples)?;
    let [first, .., last] = samples else {
        return Err(Error::TooFewPoints { what: "samples at rest", found: samples.len(), needed: 2 });
    };
    let (rate, rate_spread) = statistics(samples, |s| s.angular_rate);
    let (force, force_spread) = statistics(samples, |s| s.specific_force);
    let free_fall = force.norm() < 0.5 * options.gravity_m_s2;
    if rate_spread > options.rest_rate || force_spread > options.rest_force || free_fall {
        return Err(Error::Moving { rate_spread, force_spread, mean_force: force.norm() });
    }
    let up = force.normalize();
    let axis_for_half_turn = UnitQuaternion::from_scaled_axis(Vector3::x() * std::f64::consts::PI);
    let state = State {
        displacement: Vector3::zeros(),
        rotation: UnitQuaternion::identity(),
        velocity: Vector3::zeros(),
        world_from_start: UnitQuaternion::rotation_between(&up, &Vector3::z()).unwrap_or(axis_for_half_turn),
        gyro_bias: rate,
        accel_bias: force - up * options.gravity_m_s2,
        covariance: covariance(&up, last.timestamp_s - first.timestamp_s, options),
    };
    Ok((state, *last))
}

/// Bias and attitude are correlated: a bias across gravity tilts the attitude found from it. The heading is the datum
/// and carries no error.
fn covariance(up: &Vector3<f64>, seconds: f64, options: &ImuOptions) -> Matrix18 {
    let mean_rate = options.gyro_noise.powi(2) / seconds + options.gyro_walk.powi(2) * seconds;
    let mean_force = options.accel_noise.powi(2) / seconds + options.accel_walk.powi(2) * seconds;
    let along = up * up.transpose();
    let across = Matrix3::identity() - along;
    // g [u]x θ = −(bias + noise), so θ = [u]x (bias + noise) / g; along gravity the bias is measured.
    let bias = across * options.accel_bias_sigma.powi(2) + along * mean_force;
    let tilt = up.cross_matrix() / options.gravity_m_s2;
    let mut p = Matrix18::zeros();
    let mut set = |row: usize, column: usize, block: Matrix3<f64>| {
        p.fixed_view_mut::<3, 3>(row, column).copy_from(&block);
    };
    set(VELOCITY, VELOCITY, Matrix3::identity() * RESTING_VELOCITY.powi(2));
    set(ATTITUDE, ATTITUDE, tilt * (bias + across * mean_force) * tilt.transpose());
    set(ATTITUDE, ACCEL_BIAS, tilt * bias);
    set(ACCEL_BIAS, ATTITUDE, (tilt * bias).transpose());
    set(GYRO_BIAS, GYRO_BIAS, Matrix3::identity() * mean_rate);
    set(ACCEL_BIAS, ACCEL_BIAS, bias);
    p
}

/// Mean, and the largest standard deviation of a component.
fn statistics(samples: &[InertialSample], of: impl Fn(&InertialSample) -> Vector3<f64>) -> (Vector3<f64>, f64) {
    let count = samples.len() as f64;
    let mean = samples.iter().map(&of).sum::<Vector3<f64>>() / count;
    let square = |s: &InertialSample| (of(s) - mean).component_mul(&(of(s) - mean));
    let variance = samples.iter().map(square).sum::<Vector3<f64>>() / (count - 1.0);
    (mean, variance.max().sqrt())
}
