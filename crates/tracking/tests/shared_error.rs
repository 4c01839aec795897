//! The systematic error that all frames of a sensor share: in covariances of pairs, and in paths with loops.

use crate::common::sensor::{SIGMA, distort, drawn};
use crate::common::{Cuboid, Pinhole, Scene, frame, look_at};
use crate::sequence::{HERTZ, absolute_error, around, frame_at, poses, projection};
use nalgebra::Isometry3;
use projective_registration::{FrameAligner, FrameAlignmentOptions, OrganisedFrame, SharedError};
use rigid_pose::pose_difference;
use tracking::{TrackedPose, Tracker, TrackerOptions};

fn camera() -> Pinhole {
    Pinhole { width: 88, height: 72, focal_px: 76.0 }
}

/// Mean normalised squared error of poses of a pair, with what is assumed of the shared error.
fn normalised(shared_error: Option<SharedError>) -> f64 {
    let (camera, scene) = (camera(), Scene::furnished());
    let projection = projection(&camera);
    let options = FrameAlignmentOptions { shared_error, ..FrameAlignmentOptions::default() };
    let mut aligner = FrameAligner::new(options).unwrap();
    let [target_pose, source_pose] = [around(0), around(10)];
    let truth = target_pose.inverse() * source_pose;
    let runs = 40;
    let mut sum = 0.0;
    for seed in 0..runs {
        let field = drawn(seed);
        let prepared = |pose: &Isometry3<f64>, seed: u64| {
            let (mut points, sigma) = frame(&scene, &camera, pose, 1.0, seed);
            distort(&mut points, &camera, &field);
            OrganisedFrame::new(&projection, &points, Some(&sigma)).unwrap()
        };
        let (target, source) = (prepared(&target_pose, 500 + 2 * seed), prepared(&source_pose, 501 + 2 * seed));
        let result = aligner.align(&source, &target, &truth).unwrap();
        let error = pose_difference(&result.target_from_source, &truth);
        sum += error.dot(&result.covariance.cholesky().unwrap().solve(&error));
    }
    sum / runs as f64
}

#[test]
fn poses_of_a_distorted_sensor_err_as_stated() {
    let (known, estimated, none) =
        (normalised(Some(SharedError::known(&SIGMA))), normalised(None), normalised(Some(SharedError::none())));
    println!("known {known:.2}, estimated {estimated:.2}, none {none:.2}");
    // Mean of 40 chi-squared values of 6: 6 ± 0.55; four of these, for what the field does to the pairs themselves.
    assert!((3.8..8.2).contains(&known), "{known}");
    // A single pair tells few of the coefficients, and each with one draw.
    assert!((2.0..25.0).contains(&estimated), "{estimated}");
    assert!(none > 4.0 * known, "{none}");
}

/// Tracks a distorted or undistorted camera.
fn track(
    path: &[Isometry3<f64>],
    see: impl Fn(&Isometry3<f64>, u64) -> (Vec<[f64; 3]>, Vec<f32>),
    options: TrackerOptions,
) -> Tracker {
    let mut tracker = Tracker::new(&projection(&camera()), options).unwrap();
    for (k, pose) in path.iter().enumerate() {
        let (points, sigma) = see(pose, 70_000 + k as u64);
        tracker.track(k as f64 / HERTZ, &points, Some(&sigma), None).unwrap();
    }
    tracker
}

/// Squared errors over variances, mean of all axes and frames.
fn over_variance(tracked: &[TrackedPose], truth: &[Isometry3<f64>]) -> f64 {
    let mut sum = 0.0;
    for (pose, truth) in tracked.iter().zip(truth).skip(1) {
        let error = pose_difference(&pose.world_from_camera, truth);
        sum += (0..6).map(|k| error[k].powi(2) / pose.covariance[(k, k)]).sum::<f64>() / 6.0;
    }
    sum / (tracked.len() - 1) as f64
}

#[test]
fn paths_of_a_distorted_sensor_close_their_loops_and_err_as_stated() {
    require_honest_paths(1);
}

#[test]
#[ignore = "long: cargo xtask verify tests"]
fn paths_of_three_distorted_sensors_close_their_loops_and_err_as_stated() {
    require_honest_paths(3);
}

/// Means over sensors, each with a shared error of its own.
fn require_honest_paths(sensors: u64) {
    let path: Vec<Isometry3<f64>> = (0..300).step_by(2).chain((0..60).step_by(2)).map(around).collect();
    let truth: Vec<Isometry3<f64>> = path.iter().map(|pose| path[0].inverse() * pose).collect();
    let (mut stated, mut unaware) = (0.0, 0.0);
    for seed in 0..sensors {
        let field = drawn(900 + seed);
        let see = |pose: &Isometry3<f64>, frame: u64| {
            let (mut points, sigma) = frame_at(&camera(), pose, 1000 * seed + frame);
            distort(&mut points, &camera(), &field);
            (points, sigma)
        };
        let tracker = track(&path, see, TrackerOptions::default());
        assert!(tracker.registrations() > tracker.keyframes(), "{}", tracker.registrations());
        assert!(tracker.shared_error().registrations() > 3);
        stated += over_variance(tracker.trajectory(), &truth) / sensors as f64;
        let mut options = TrackerOptions::default();
        options.alignment.shared_error = Some(SharedError::none());
        unaware += over_variance(track(&path, see, options).trajectory(), &truth) / sensors as f64;
    }
    println!("squared error over variance {stated:.2}, without the shared error {unaware:.2}");
    // Each sensor has one draw of what decides.
    assert!((0.1..4.0).contains(&stated), "{stated}");
    assert!(unaware > 4.0 * stated, "{unaware}");
}

/// Rooms that are alike, side by side along a corridor, 1.5 m apart.
fn alike() -> Scene {
    let boxes = (-2..14).flat_map(|k| {
        let x = 1.5 * f64::from(k);
        [
            Cuboid::new([x, 1.2, -1.2], [x + 0.4, 1.8, 0.3]),
            Cuboid::new([x + 0.7, 1.4, -1.2], [x + 1.2, 1.8, -0.4]),
            Cuboid::new([x + 0.2, 1.0, -1.2], [x + 0.9, 1.3, -0.9]),
        ]
    });
    Scene { room: Cuboid::new([-6.0, -1.0, -1.2], [24.0, 1.8, 1.4]), boxes: boxes.collect() }
}

#[test]
fn rooms_that_look_alike_close_no_loop() {
    let scene = alike();
    let path: Vec<Isometry3<f64>> = (0..150)
        .map(|k| {
            let x = 0.04 * f64::from(k);
            look_at([x, -0.6 + 0.1 * (4.0 * x).sin(), 0.2 + 0.1 * x.cos()], [x + 0.3, 1.8, -0.4])
        })
        .collect();
    let see = |pose: &Isometry3<f64>, seed: u64| frame(&scene, &camera(), pose, 1.0, seed);
    let tracker = track(&path, see, TrackerOptions::default());
    let tracked = tracker.adjusted_trajectory();
    assert!(tracked.iter().all(|pose| pose.state.has_pose()));
    let truth: Vec<Isometry3<f64>> = path.iter().map(|pose| path[0].inverse() * pose).collect();
    let (rms, largest) = absolute_error(&poses(&tracked), &truth);
    println!("{} keyframes, {} registrations, {rms:.4} m", tracker.keyframes(), tracker.registrations());
    // The next room is 1.5 m away: one wrong loop would bend the path by decimetres.
    assert!(rms < 0.03 && largest < 0.06, "{rms} {largest}");
}
