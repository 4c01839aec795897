//! The common errors of four stations whose poses were registered.
#![allow(clippy::expect_used, missing_docs)]

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
use common_errors::nalgebra::{Isometry3, Matrix6, Vector3};
use common_errors::{Corrected, Frame, common_errors};
use criterion::{Criterion, criterion_group, criterion_main};
use error_models::{ModelSet, RangeErrorModel};
use range_io::calibration::Calibration;

fn stations(criterion: &mut Criterion) {
    let format = ImageFormat::new(176, 144, [0.04, 0.04]).expect("a format");
    let interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 };
    let camera = Camera::new(format, interior, LensDistortion::default()).expect("a camera");
    let models = ModelSet { entries: vec![(0.002, vec![RangeErrorModel::error_free(5.0)])] };
    let calibration = Calibration::from_models(&camera, &models, None).expect("a calibration");
    let frame = |index: usize| Frame {
        view: format!("S{index}"),
        station: format!("S{index}"),
        world_from_camera: Isometry3::translation(index as f64, 0.0, 0.0) * Isometry3::rotation(Vector3::y() * 0.1),
        stated_covariance: Some(Matrix6::identity() * 1e-6),
        range_model: Some(0),
        drift_sigma_m: Some(0.001),
        sensor: None,
    };
    let frames: Vec<Frame> = (0..100).map(frame).collect();
    let both = Corrected { rays: true, ranges: true };
    criterion.bench_function("common_errors/100 stated stations", |bencher| {
        bencher.iter(|| common_errors(&frames, &camera, Some((&calibration, both)), None).expect("errors"));
    });
}

criterion_group!(benches, stations);
criterion_main!(benches);
