//! An inertial unit carries the camera along a bare wall.

use crate::common::{Cuboid, Pinhole, Scene, frame, look_at};
use crate::sequence::{HERTZ, projection};
use nalgebra::{Isometry3, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rigid_pose::pose_difference;
use tracking::{
    ImuIntegrator, ImuNoise, InertialSample, LossReason, Relocalisation, TrackedPose, Tracker, TrackerOptions,
    TrackingState,
};

const FRAMES: usize = 130;
const IMU_HERTZ: f64 = 200.0;
/// Until the camera has its speed, second.
const START: f64 = 1.0;
const ACCELERATION: f64 = 0.6;

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

fn world_from_camera(t: f64) -> Isometry3<f64> {
    let x = match t {
        t if t < 0.0 => 0.0,
        t if t < START => 0.5 * ACCELERATION * t * t,
        t => ACCELERATION * START * (t - 0.5 * START),
    };
    look_at([x, 0.0, 0.0], [x, 3.0, 0.0])
}

/// The unit on the camera.
fn camera_from_body() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(0.03, -0.02, 0.05), Vector3::new(0.1, 1.5, -0.3))
}

/// Noisy samples with constant biases, in body axes.
fn samples(noise: &ImuNoise) -> Vec<InertialSample> {
    let mut random = Pcg64::seed_from_u64(5);
    let mut normal = || Vector3::from_fn(|_, _| -> f64 { StandardNormal.sample(&mut random) });
    let (gyro_bias, accel_bias) = (normal() * 0.01, normal() * 0.1);
    let root = IMU_HERTZ.sqrt();
    let last = (FRAMES as f64 / HERTZ * IMU_HERTZ) as i32;
    (-100..=last)
        .map(|i| {
            let t = f64::from(i) / IMU_HERTZ;
            let along = if (0.0..START).contains(&t) { ACCELERATION } else { 0.0 };
            let world_from_body = world_from_camera(t) * camera_from_body();
            let force = world_from_body.rotation.inverse() * Vector3::new(along, 0.0, 9.80665);
            InertialSample {
                timestamp_s: t,
                angular_rate: gyro_bias + normal() * noise.gyro_density * root,
                specific_force: force + accel_bias + normal() * noise.accel_density * root,
            }
        })
        .collect()
}

fn tracked(with_imu: bool) -> Vec<TrackedPose> {
    let camera = Pinhole { width: 88, height: 72, focal_px: 76.0 };
    let noise = ImuNoise::default();
    let all = samples(&noise);
    let mut imu = ImuIntegrator::from_rest(&all[..101], &camera_from_body(), &noise).unwrap();
    // A bare wall gives alignment without a guess nothing to find, at a hundred times the price.
    let tracking = TrackerOptions { relocalisation: Relocalisation::Projective, ..TrackerOptions::default() };
    let mut tracker = Tracker::new(&projection(&camera), tracking).unwrap();
    for k in 0..FRAMES {
        let t = k as f64 / HERTZ;
        let (points, sigma) = frame(&scene(), &camera, &world_from_camera(t), 1.0, 90_000 + k as u64);
        let prior = imu.motion(&all, t).unwrap();
        let pose = tracker.track(t, &points, Some(&sigma), (with_imu && k > 0).then_some(&prior)).unwrap();
        imu.frame(pose.measured_motion.as_ref()).unwrap();
    }
    tracker.trajectory().to_vec()
}

#[test]
fn an_inertial_unit_carries_the_camera_along_a_bare_wall() {
    let alone = tracked(false);
    assert!(alone.iter().any(|pose| pose.state == TrackingState::Lost(LossReason::Undetermined)));
    let carried = tracked(true);
    assert!(carried[1..].iter().all(|pose| pose.state == TrackingState::Tracked));
    let last = carried[FRAMES - 1];
    let t = (FRAMES - 1) as f64 / HERTZ;
    let error = pose_difference(&last.world_from_camera, &(world_from_camera(0.0).inverse() * world_from_camera(t)));
    let sigma = last.covariance[(0, 0)].sqrt();
    // A second of bare wall: a velocity good to some mm/s and forces good to some mm/s² leave centimetres at most.
    assert!(error[0].abs() < 4.0 * sigma && sigma < 60e-3, "{} {sigma}", error[0]);
    // Across the wall the frames hold it.
    assert!(error[2].abs() < 8e-3, "{}", error[2]);
}
