//! The file of common errors of three stations with stated poses and a drift.
//!
//! `cargo run --release -p common-errors --example drifting_frames`
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
use common_errors::nalgebra::{Isometry3, Matrix6};
use common_errors::{Frame, common_errors};

fn main() {
    let format = ImageFormat::new(176, 144, [0.04, 0.04]).unwrap();
    let interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 };
    let camera = Camera::new(format, interior, LensDistortion::default()).unwrap();
    let frame = |index: usize| Frame {
        view: format!("S{index}"),
        station: format!("S{index}"),
        world_from_camera: Isometry3::translation(index as f64, 0.0, 0.0),
        stated_covariance: Some(Matrix6::identity() * 1e-6),
        range_model: None,
        drift_sigma_m: Some(0.001 * (index + 1) as f64),
        sensor: None,
    };
    let frames: Vec<Frame> = (0..3).map(frame).collect();
    let file = common_errors(&frames, &camera, None, None).unwrap();
    for (error, row) in file.errors.iter().zip(&file.covariance) {
        println!("{:<12} {:?} {:.1e}", error.name, error.source, row.last().unwrap().sqrt());
    }
}
