//! A hand-held camera past a bare wall: what an inertial unit does for its attitude.

use crate::common::{Cuboid, Pinhole, Scene, frame, look_at};
use crate::sequence::{HERTZ, projection};
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use tracking::inertial::{Biases, ImuNoise, Preintegrated};
use tracking::{ImuIntegrator, InertialSample, MotionPrior, Relocalisation, Tracker, TrackerOptions};

const FRAMES: usize = 120;
const IMU_HERTZ: f64 = 200.0;

/// One wall with boxes on it; after 1.5 m it is bare.
fn scene() -> Scene {
    Scene {
        room: Cuboid::new([-30.0, -30.0, -30.0], [60.0, 2.0, 30.0]),
        boxes: vec![
            Cuboid::new([-1.2, 1.2, -0.6], [-0.8, 2.0, 0.2]),
            Cuboid::new([-0.3, 1.5, -1.0], [0.2, 2.0, -0.5]),
            Cuboid::new([-0.5, 1.6, 0.4], [-0.1, 2.0, 0.9]),
        ],
    }
}

/// At rest until t = 0, then along the wall, swaying and rolling as a hand does.
fn world_from_camera(t: f64, phase: f64) -> Isometry3<f64> {
    // Begins with velocity and acceleration zero.
    let s = if t <= 0.0 { 0.0 } else { t * t * t / (0.4 + t * t) };
    let sway = |amplitude: f64, rate: f64| amplitude * ((rate * s + phase).sin() - phase.sin());
    let pose = look_at([0.75 * s, sway(0.05, 2.1), sway(0.06, 1.7)], [0.75 * s, 3.0, sway(0.06, 1.7)]);
    let turn = UnitQuaternion::from_euler_angles(sway(0.08, 1.9), sway(0.08, 1.3), sway(0.35, 1.1));
    pose * Isometry3::from_parts(Vector3::zeros().into(), turn)
}

/// The unit on the camera.
fn camera_from_body() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(0.03, -0.02, 0.05), Vector3::new(0.1, 1.5, -0.3))
}

/// Noisy samples with constant biases, in body axes.
fn samples(noise: &ImuNoise, phase: f64, seed: u64) -> Vec<InertialSample> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut normal = || Vector3::from_fn(|_, _| -> f64 { StandardNormal.sample(&mut random) });
    let (gyro_bias, accel_bias) = (normal() * 0.01, normal() * 0.1);
    let root = IMU_HERTZ.sqrt();
    let last = (FRAMES as f64 / HERTZ * IMU_HERTZ) as i32;
    (-100..=last)
        .map(|i| {
            let t = f64::from(i) / IMU_HERTZ;
            let body = |t: f64| world_from_camera(t, phase) * camera_from_body();
            let [before, at, after] = [-1e-3, 0.0, 1e-3].map(|h| body(t + h));
            let bent = (after.translation.vector - at.translation.vector * 2.0 + before.translation.vector) / 1e-6;
            let force = at.rotation.inverse() * (bent + Vector3::new(0.0, 0.0, 9.80665));
            let rate = (before.rotation.inverse() * after.rotation).scaled_axis() / 2e-3;
            InertialSample {
                timestamp_s: t,
                angular_rate: rate + gyro_bias + normal() * noise.gyro_density * root,
                specific_force: force + accel_bias + normal() * noise.accel_density * root,
            }
        })
        .collect()
}

/// What the tracker is told of the motion.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Told {
    Nothing,
    Turn,
    Motion,
}

/// The camera's rotation between two frames from the gyroscope alone, its bias as it was at rest.
fn turn(all: &[InertialSample], interval_s: [f64; 2], biases: &Biases, noise: &ImuNoise) -> MotionPrior {
    let motion = Preintegrated::new(all, interval_s, biases, noise).unwrap();
    let camera_from_body = camera_from_body().rotation;
    let previous_from_current = camera_from_body * motion.rotation * camera_from_body.inverse();
    // The bias is the mean of half a second of samples.
    let seconds = interval_s[1] - interval_s[0];
    let variance = noise.gyro_density.powi(2) * (seconds + seconds * seconds / 0.5);
    MotionPrior::of_turn(previous_from_current.inverse(), &(Matrix3::identity() * variance))
}

/// Root mean square error of the attitude over all frames, radian.
fn attitude_error(told: Told, phase: f64, seed: u64) -> f64 {
    let camera = Pinhole { width: 88, height: 72, focal_px: 76.0 };
    let noise = ImuNoise::default();
    let all = samples(&noise, phase, seed);
    let mut imu = ImuIntegrator::from_rest(&all[..101], &camera_from_body(), &noise).unwrap();
    let resting = Biases { gyro: imu.biases()[0], accel: Vector3::zeros() };
    // A bare wall gives alignment without a guess nothing to find, at a hundred times the price.
    let tracking = TrackerOptions { relocalisation: Relocalisation::Projective, ..TrackerOptions::default() };
    let mut tracker = Tracker::new(&projection(&camera), tracking).unwrap();
    let mut squares = 0.0;
    for k in 0..FRAMES {
        let t = k as f64 / HERTZ;
        let (points, sigma) = frame(&scene(), &camera, &world_from_camera(t, phase), 1.0, 1000 * seed + k as u64);
        let prior = imu.motion(&all, t).unwrap();
        let prior = match told {
            Told::Turn if k > 0 => Some(turn(&all, [t - 1.0 / HERTZ, t], &resting, &noise)),
            Told::Motion if k > 0 => Some(prior),
            _ => None,
        };
        let pose = tracker.track(t, &points, Some(&sigma), prior.as_ref()).unwrap();
        imu.frame(pose.measured_motion.as_ref()).unwrap();
        let truth = world_from_camera(0.0, phase).inverse() * world_from_camera(t, phase);
        squares += pose.world_from_camera.rotation.angle_to(&truth.rotation).powi(2);
    }
    (squares / FRAMES as f64).sqrt()
}

#[test]
fn a_unit_keeps_the_attitude_past_a_bare_wall() {
    for (phase, seed) in [(0.3, 1), (1.9, 2)] {
        let told = [Told::Nothing, Told::Turn, Told::Motion];
        let [alone, turned, carried] = told.map(|told| attitude_error(told, phase, seed).to_degrees());
        eprintln!("attitude: {alone:.3} degree alone, {turned:.3} with the gyroscope, {carried:.3} with the unit");
        assert!(turned < alone / 3.0 && carried < alone / 3.0, "{alone} {turned} {carried}");
    }
}

#[test]
fn a_turn_that_is_none_is_refused() {
    let camera = Pinhole { width: 88, height: 72, focal_px: 76.0 };
    let mut tracker = Tracker::new(&projection(&camera), TrackerOptions::default()).unwrap();
    let (points, sigma) = frame(&scene(), &camera, &world_from_camera(0.0, 0.0), 1.0, 1);
    for variance in [f64::NAN, f64::INFINITY, -1.0, 0.0] {
        let prior = MotionPrior::of_turn(UnitQuaternion::identity(), &(Matrix3::identity() * variance));
        assert!(tracker.track(0.0, &points, Some(&sigma), Some(&prior)).is_err(), "{variance}");
    }
}
