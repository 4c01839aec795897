//! A unit at rest: its rates are their bias, its forces gravity.

use inertial::{Biases, ImuNoise, InertialSample, NavigationState, Rest, StateCovariance, rest};
use nalgebra::{Isometry3, Matrix3, SMatrix, Vector3};
use orientation::TimedPose;
use rigid_pose::Uncertain;

use crate::imu::anchor::{ACCEL, Anchor, GRAVITY, GYRO, VELOCITY};

/// Velocity that passes for rest, m/s: a tripod on a floor.
const VELOCITY_SIGMA: f64 = 1e-3;
/// The state at a known pose up to which the unit has rested since its first sample.
///
/// Gravity is what the forces show there, with the bias of the unit in it: where the unit turns away, that bias becomes an acceleration.
///
/// # Errors
/// Words where it has not rested, or for too short a time.
pub(crate) fn at_rest(
    samples: &[InertialSample],
    known: &TimedPose,
    camera_from_body: &Isometry3<f64>,
    noise: &ImuNoise,
) -> Result<Anchor, String> {
    let resting = &samples[..samples.partition_point(|sample| sample.timestamp_s <= known.time_s)];
    let Rest { rate, force, seconds } = rest(resting, noise).map_err(|unrest| {
        format!(
            "before the first known pose (at {} s) {unrest}; four known poses give velocity and biases without a rest, and if the \
             clocks differ, shift one",
            known.time_s
        )
    })?;
    let world_from_body = known.pose.then(&Uncertain::exact(*camera_from_body));
    let rotation = world_from_body.pose.rotation.to_rotation_matrix().into_inner();
    // Errors that are independent of each other: pose, velocity, gyro bias, accel bias, mean force.
    let mut own = StateCovariance::zeros();
    own.fixed_view_mut::<6, 6>(0, 0).copy_from(&world_from_body.covariance);
    let variances = [
        (VELOCITY, VELOCITY_SIGMA.powi(2)),
        (GYRO, noise.gyro_density.powi(2) / seconds + noise.gyro_walk.powi(2) * seconds / 3.0),
        (ACCEL, noise.accel_bias_sigma.powi(2)),
        (GRAVITY, noise.accel_density.powi(2) / seconds),
    ];
    for (at, variance) in variances {
        own.fixed_view_mut::<3, 3>(at, at).copy_from(&(Matrix3::identity() * variance));
    }
    // g = −R f, with the errors of R, the bias and the mean of f in it.
    let mut all = SMatrix::<f64, 18, 18>::identity();
    all.fixed_view_mut::<3, 3>(GRAVITY, 3).copy_from(&(rotation * force.cross_matrix()));
    all.fixed_view_mut::<3, 3>(GRAVITY, ACCEL).copy_from(&rotation);
    all.fixed_view_mut::<3, 3>(GRAVITY, GRAVITY).copy_from(&-rotation);
    Ok(Anchor {
        time_s: known.time_s,
        state: NavigationState { world_from_body: world_from_body.pose, velocity: Vector3::zeros() },
        biases: Biases { gyro: rate, accel: Vector3::zeros() },
        gravity: -(rotation * force),
        covariance: all * own * all.transpose(),
    })
}
