//! Streams of frames: a camera on its way through the furnished room, and errors of trajectories.
#![allow(dead_code, clippy::unwrap_used, missing_docs)]

use std::sync::Arc;

use nalgebra::{Isometry3, Point3};
use projective_registration::Projection;
use rigid_pose::absolute_orientation;
use tracking::TrackedPose;

use crate::common::{Pinhole, Scene, frame_with_mixed_pixels, look_at};

/// Frames a second.
pub const HERTZ: f64 = 30.0;

pub fn projection(camera: &Pinhole) -> Arc<Projection> {
    let centre = [(camera.width as f64 - 1.0) / 2.0, (camera.height as f64 - 1.0) / 2.0];
    let focal = [camera.focal_px; 2];
    Arc::new(Projection::pinhole(camera.width, camera.height, focal, centre).unwrap())
}

/// A closed path around the room in ten seconds, looking across it: 1.6 cm and 1.2 degrees a frame.
pub fn around(frame: usize) -> Isometry3<f64> {
    let angle = frame as f64 / 300.0 * std::f64::consts::TAU;
    let position = [0.9 * angle.cos(), 0.6 * angle.sin(), 1.4 + 0.15 * (2.0 * angle).sin()];
    let turned = angle + std::f64::consts::PI + 0.3 * (3.0 * angle).sin();
    look_at(position, [2.2 * turned.cos(), 1.8 * turned.sin(), 0.6 + 0.2 * (2.0 * angle).cos()])
}

/// Points and sigma of a frame with noise and mixed pixels.
pub fn frame_at(camera: &Pinhole, world_from_camera: &Isometry3<f64>, seed: u64) -> (Vec<[f64; 3]>, Vec<f32>) {
    frame_with_mixed_pixels(&Scene::furnished(), camera, world_from_camera, seed)
}

/// Root mean square distance of the positions after the best rigid alignment, and its largest value, metre.
pub fn absolute_error(estimate: &[Isometry3<f64>], truth: &[Isometry3<f64>]) -> (f64, f64) {
    let points = |poses: &[Isometry3<f64>]| -> Vec<Point3<f64>> {
        poses.iter().map(|pose| Point3::from(pose.translation.vector)).collect()
    };
    let (estimate, truth) = (points(estimate), points(truth));
    let fit = absolute_orientation(&estimate, &truth, None).unwrap();
    let squares: Vec<f64> =
        estimate.iter().zip(&truth).map(|(e, t)| (fit.target_from_source * e - t).norm_squared()).collect();
    let largest = squares.iter().copied().fold(0.0, f64::max).sqrt();
    ((squares.iter().sum::<f64>() / squares.len() as f64).sqrt(), largest)
}

/// Root mean square error of the motion over `step` frames: metre and radian.
pub fn relative_error(estimate: &[Isometry3<f64>], truth: &[Isometry3<f64>], step: usize) -> (f64, f64) {
    let count = estimate.len() - step;
    let (mut metre, mut radian) = (0.0, 0.0);
    for k in 0..count {
        let motion = |poses: &[Isometry3<f64>]| poses[k].inverse() * poses[k + step];
        let error = motion(truth).inverse() * motion(estimate);
        metre += error.translation.vector.norm_squared();
        radian += error.rotation.angle().powi(2);
    }
    ((metre / count as f64).sqrt(), (radian / count as f64).sqrt())
}

pub fn poses(tracked: &[TrackedPose]) -> Vec<Isometry3<f64>> {
    tracked.iter().map(|pose| pose.world_from_camera).collect()
}

/// Mean normalised squared error of the poses after the datum: six for an honest covariance.
pub fn normalised_error(tracked: &[TrackedPose], truth: &[Isometry3<f64>]) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for (pose, truth) in tracked.iter().zip(truth) {
        if let Some(factor) = pose.covariance.cholesky() {
            let error = rigid_pose::pose_difference(&pose.world_from_camera, truth);
            sum += error.dot(&factor.solve(&error));
            count += 1;
        }
    }
    sum / f64::from(count)
}
