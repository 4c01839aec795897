//! Differences of a frame to a plane, and the estimation of range terms from them.
#![allow(missing_docs, clippy::unwrap_used)]

use camera_model::{Camera, InteriorOrientation, LensDistortion};
use criterion::{Criterion, criterion_group, criterion_main};
use error_models::{AmplitudeHyperbola, RangeErrorModel, RangeTerms};
use nalgebra::Isometry3;
use range_image::{Flags, ImageFormat, RangeFrame, Raster};
use self_calibration::{
    DifferenceOptions, Plane, RangeDifference, RangeTermOptions, differences_to_plane, estimate_range_terms,
};

fn camera(width: usize, height: usize) -> Camera {
    let format = ImageFormat::new(width, height, [7.0 / width as f64; 2]).unwrap();
    let interior = InteriorOrientation { principal_point_mm: [0.0; 2], principal_distance_mm: 8.0 };
    Camera::new(format, interior, LensDistortion { k1: -1e-3, ..LensDistortion::default() }).unwrap()
}

fn frames(criterion: &mut Criterion) {
    let (pose, plane) = (Isometry3::identity(), Plane::facing_camera(3.0).unwrap());
    for (width, height) in [(176, 144), (640, 480), (1024, 1024)] {
        let frame = RangeFrame {
            range: Raster::filled(width, height, 3.0),
            sigma: Raster::filled(width, height, 0.01),
            amplitude: Raster::filled(width, height, 100.0),
            flags: Raster::filled(width, height, Flags::empty()),
        };
        let (camera, options) = (camera(width, height), DifferenceOptions::default());
        criterion.bench_function(&format!("differences_to_plane/{width}x{height}"), |bencher| {
            bencher.iter(|| differences_to_plane(&frame, &camera, &pose, &plane, &options).unwrap());
        });
    }
}

fn estimation(criterion: &mut Criterion) {
    for count in [4_000, 40_000] {
        let differences: Vec<RangeDifference> = (0..count).map(difference).collect();
        for (name, options) in [
            ("terms", RangeTermOptions::default()),
            ("terms and hyperbola", RangeTermOptions::default().hold("d0", 0.02).unwrap().with_hyperbola()),
        ] {
            criterion.bench_function(&format!("estimate_range_terms/{name}/{count} differences"), |bencher| {
                bencher.iter(|| estimate_range_terms(&differences, 5.0, &options).unwrap());
            });
        }
    }
}

/// Ranges over one ambiguity interval, image points, amplitudes and errors over their domains by irrational steps.
fn difference(index: usize) -> RangeDifference {
    let spread = |factor: f64| (index as f64 * factor).fract();
    let observed_range_m = 0.5 + 5.0 * spread(0.618_033_988_75);
    let amplitude = 10.0 * 100.0_f64.powf(spread(0.414_213_562_37));
    let [x_mm, y_mm] = [0.732_050_807_57, 0.236_067_977_5].map(|factor| 7.0 * spread(factor) - 3.5);
    let corrected = model().corrected_range(observed_range_m, x_mm, y_mm, amplitude);
    let reference_range_m = corrected + 0.01 * (spread(0.645_751_311_06) - 0.5);
    RangeDifference { observed_range_m, reference_range_m, x_mm, y_mm, amplitude, sigma_m: 0.003 }
}

fn model() -> RangeErrorModel {
    RangeErrorModel {
        terms: RangeTerms { d0: 0.02, periodic: [0.006, -0.004, 0.003, 0.005, -0.009, 0.004], e1: 2e-3, e2: -1e-3 },
        hyperbola: Some(AmplitudeHyperbola { h1: 0.002, h2: 0.05, h3: 25.0, amplitude_span: [10.0, 1000.0] }),
        ..RangeErrorModel::error_free(5.0)
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = frames, estimation
}
criterion_main!(benches);
