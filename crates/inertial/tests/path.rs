//! A motion in closed form, and what a unit measures on it.

use inertial::{Biases, ImuNoise, InertialSample};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

pub const GRAVITY: [f64; 3] = [1.0, -9.2, 3.246];

pub fn gravity() -> Vector3<f64> {
    Vector3::from(GRAVITY).normalize() * 9.80665
}

/// A hand-held body: all axes, some tenths of a metre and of a radian.
pub fn world_from_body(t: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.6 * (1.1 * t).sin(), 0.0))
        * UnitQuaternion::from_scaled_axis(Vector3::new(0.5 * (1.7 * t).sin(), 0.0, 0.0))
        * UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, 0.4 * (0.9 * t).cos()));
    let place = Vector3::new(0.4 * (1.3 * t).sin(), 0.3 * (0.8 * t).cos(), 0.2 * (1.9 * t).sin());
    Isometry3::from_parts(place.into(), turn)
}

pub fn velocity(t: f64) -> Vector3<f64> {
    Vector3::new(0.52 * (1.3 * t).cos(), -0.24 * (0.8 * t).sin(), 0.38 * (1.9 * t).cos())
}

/// Error-free sample.
pub fn clean(t: f64) -> InertialSample {
    let acceleration = Vector3::new(-0.676 * (1.3 * t).sin(), -0.192 * (0.8 * t).cos(), -0.722 * (1.9 * t).sin());
    // Differences of fourth order: 1e-11 rad/s.
    let log = |h: f64| {
        (world_from_body(t - h).rotation.inverse() * world_from_body(t + h).rotation).scaled_axis() / (2.0 * h)
    };
    let angular_rate = (log(1e-3) * 4.0 - log(2e-3)) / 3.0;
    let specific_force = world_from_body(t).rotation.inverse() * (acceleration - gravity());
    InertialSample { timestamp_s: t, angular_rate, specific_force }
}

/// Samples of an interval with noise and constant biases.
pub fn measured(range: [f64; 2], hertz: f64, noise: &ImuNoise, biases: &Biases, seed: u64) -> Vec<InertialSample> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut normal = || Vector3::from_fn(|_, _| -> f64 { StandardNormal.sample(&mut random) });
    let count = ((range[1] - range[0]) * hertz).round() as usize;
    let root = hertz.sqrt();
    (0..=count)
        .map(|k| {
            let sample = clean(range[0] + k as f64 / hertz);
            InertialSample {
                angular_rate: sample.angular_rate + biases.gyro + normal() * noise.gyro_density * root,
                specific_force: sample.specific_force + biases.accel + normal() * noise.accel_density * root,
                ..sample
            }
        })
        .collect()
}
