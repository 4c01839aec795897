//! A camera walks 30 cm along a wavy wall, and the tracker tells where it is: `cargo run -p tracking --example follow`.

#![allow(clippy::print_stdout)]

use std::sync::Arc;

use nalgebra::{Isometry3, Point3};
use projective_registration::Projection;
use tracking::{Tracker, TrackerOptions};

/// Columns and rows of the camera, and its principal distance in pixels.
const SIZE: [usize; 2] = [88, 72];
const FOCAL_PX: f64 = 76.0;

/// The points of one frame, row by row, in the camera's axes (x right, y up, looking along -z), metre. A frame of a real
/// camera comes from a `camera_model::RayTable`; pixels without a range are NaN.
fn seen_from(world_from_camera: &Isometry3<f64>) -> Vec<[f64; 3]> {
    let pixel = |index: usize| {
        let (col, row) = ((index % SIZE[0]) as f64, (index / SIZE[0]) as f64);
        let [u, v] = [(col - 43.5) / FOCAL_PX, (35.5 - row) / FOCAL_PX];
        // The wall z = -3 + waves, by fixed-point iteration along the ray.
        let mut depth = 3.0;
        for _ in 0..20 {
            let at = world_from_camera * Point3::new(u * depth, v * depth, -depth);
            depth += at.z + 3.0 + 0.1 * (1.5 * at.x).sin() + 0.08 * (2.0 * at.y).cos();
        }
        [u * depth, v * depth, -depth]
    };
    (0..SIZE[0] * SIZE[1]).map(pixel).collect()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let projection = Arc::new(Projection::pinhole(SIZE[0], SIZE[1], [FOCAL_PX; 2], [43.5, 35.5])?);
    let mut tracker = Tracker::new(&projection, TrackerOptions::default())?;
    for frame in 0..=30 {
        let truth = Isometry3::translation(0.01 * f64::from(frame), 0.0, 0.0);
        // Neither deviations of the ranges nor a motion from an inertial unit.
        let pose = tracker.track(f64::from(frame) / 30.0, &seen_from(&truth), None, None)?;
        if frame % 10 == 0 {
            let (found, known) = (pose.world_from_camera.translation.vector, truth.translation.vector);
            let error_mm = 1e3 * (found - known).norm();
            println!("frame {frame:2}: {:?}, x = {:.3} m, {error_mm:.2} mm off", pose.state, found.x);
        }
    }
    println!("{} keyframes, {} points in the map", tracker.keyframes(), tracker.map().points.len());
    Ok(())
}
