//! A hand-held camera at 10 Hz and a unit at 200 Hz: how well biases, gravity and mounting are known after 3, 6 and 21 poses.
#![allow(clippy::print_stdout)]

use inertial::nalgebra::{Isometry3, Matrix6, Vector3, Vector6};
use inertial::rigid_pose::{Uncertain, step_pose};
use inertial::{Biases, CameraPose, ImuNoise, InertialSample, Mounting, SequenceOptions, estimate_sequence};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

const GRAVITY: f64 = 9.80665;

fn world_from_body(t: f64) -> Isometry3<f64> {
    let turn = Vector3::new(0.5 * (1.7 * t).sin(), 0.6 * (1.1 * t).sin(), 0.4 * (0.9 * t).cos());
    Isometry3::new(Vector3::new(0.4 * (1.3 * t).sin(), 0.3 * (0.8 * t).cos(), 0.2 * (1.9 * t).sin()), turn)
}

fn main() -> Result<(), inertial::Error> {
    let mut generator = Pcg64::seed_from_u64(1);
    let mut normal = || -> f64 { StandardNormal.sample(&mut generator) };
    let noise = ImuNoise { gyro_density: 1e-3, accel_density: 1e-2, ..ImuNoise::default() };
    let truth = Biases { gyro: Vector3::new(0.02, -0.01, 0.015), accel: Vector3::new(0.1, -0.2, 0.05) };
    let camera_from_body = Isometry3::new(Vector3::new(0.03, -0.02, 0.05), Vector3::new(0.1, 1.5, -0.3));
    let mut samples = Vec::new();
    for k in 0..600 {
        let t = f64::from(k) * 0.005;
        let [before, at, after] = [-1e-3, 0.0, 1e-3].map(|h| world_from_body(t + h));
        let acceleration = (after.translation.vector - at.translation.vector * 2.0 + before.translation.vector) / 1e-6;
        let rate = (before.rotation.inverse() * after.rotation).scaled_axis() / 2e-3;
        let mut noisy = |value: Vector3<f64>, bias: Vector3<f64>, density: f64| {
            value + bias + Vector3::from_fn(|_, _| density * 200.0_f64.sqrt() * normal())
        };
        samples.push(InertialSample {
            timestamp_s: t,
            angular_rate: noisy(rate, truth.gyro, noise.gyro_density),
            specific_force: noisy(
                at.rotation.inverse() * (acceleration + Vector3::new(0.0, GRAVITY, 0.0)),
                truth.accel,
                noise.accel_density,
            ),
        });
    }
    for count in [3, 6, 21] {
        let poses: Vec<CameraPose> = (0..count)
            .map(|k| {
                let time_s = 0.2 + 0.1 * f64::from(k);
                let pose = world_from_body(time_s) * camera_from_body.inverse();
                let pose = step_pose(&pose, &Vector6::from_fn(|_, _| 1e-3 * normal()));
                CameraPose { time_s, pose: Uncertain { pose, covariance: Matrix6::identity() * 1e-6 } }
            })
            .collect();
        let mounting = Mounting::Known(camera_from_body);
        let found =
            estimate_sequence(&poses, &samples, &SequenceOptions { noise, mounting, ..SequenceOptions::default() })?;
        let last = &found.states[found.states.len() - 1];
        let sigma = last.bias_covariance().diagonal().map(f64::sqrt);
        println!("{count} poses (sigma0 {:.2?}):", found.sigma0);
        println!("  gyroscope     {:.4?} +- {:.4?} rad/s", last.biases.gyro.as_slice(), &sigma.as_slice()[..3]);
        println!("  accelerometer {:.3?} +- {:.3?} m/s2", last.biases.accel.as_slice(), &sigma.as_slice()[3..]);
        println!("  gravity       {:.3?} m/s2", found.gravity.as_slice());
    }
    println!("truth: {:.4?} rad/s, {:.3?} m/s2", truth.gyro.as_slice(), truth.accel.as_slice());
    Ok(())
}
