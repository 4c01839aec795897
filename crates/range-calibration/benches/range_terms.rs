//! Differences of a frame to a plane, and the estimation of range terms from them.
#![allow(missing_docs, clippy::unwrap_used)]

use camera_model::{Camera, InteriorOrientation, LensDistortion};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use error_models::{AmplitudeHyperbola, RangeErrorModel, RangeTerms, distort_frame};
use nalgebra::{Isometry3, Point3, Vector3};
use range_calibration::{
    DifferenceOptions, Plane, PlaneCalibrationOptions, PlaneCapture, RangeDifference, RangeTermOptions,
    calibrate_planes, differences_to_plane, estimate_range_terms,
};
use range_image::{Flags, ImageFormat, RangeFrame, Raster};

fn camera(width: usize, height: usize) -> Camera {
    let format = ImageFormat::new(width, height, [7.0 / width as f64; 2]).unwrap();
    let interior = InteriorOrientation { principal_point_mm: [0.0; 2], principal_distance_mm: 8.0 };
    Camera::new(format, interior, LensDistortion { k1: -1e-3, ..LensDistortion::default() }).unwrap()
}

fn frames(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("differences_to_plane");
    let (pose, plane) = (Isometry3::identity(), Plane::facing_camera(3.0).unwrap());
    for (width, height) in [(176, 144), (640, 480), (1024, 1024)] {
        let frame = RangeFrame {
            range: Raster::filled(width, height, 3.0),
            sigma: Raster::filled(width, height, 0.01),
            amplitude: Raster::filled(width, height, 100.0),
            flags: Raster::filled(width, height, Flags::empty()),
        };
        let (camera, options) = (camera(width, height), DifferenceOptions::default());
        group.throughput(Throughput::Elements((width * height) as u64));
        group.bench_function(format!("{width}x{height}"), |bencher| {
            bencher.iter(|| differences_to_plane(&frame, &camera, &pose, &plane, &options).unwrap());
        });
    }
}

/// Twelve captures of a wall at known distances, the wall itself and a common set of terms unknown.
fn unknown_plane(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("calibrate_planes");
    for (width, height, step) in [(176, 144, 4), (640, 480, 4), (640, 480, 1), (1024, 1024, 4)] {
        let camera = camera(width, height);
        let poses: Vec<_> = (0..12).map(|i| Isometry3::translation(0.0, 0.0, -0.4 * f64::from(i))).collect();
        let frames: Vec<_> = poses.iter().map(|pose| wavy_wall(&camera, pose)).collect();
        let capture = |(index, frame)| PlaneCapture {
            name: format!("S{index}"),
            frame,
            world_from_camera: Some(poses[index]),
            drift_m: 0.0,
            covariance: None,
            plane: 0,
        };
        let captures: Vec<_> = frames.iter().enumerate().map(capture).collect();
        let mut options = PlaneCalibrationOptions::default();
        options.pixels.step = step;
        group.throughput(Throughput::Elements((12 * (width / step) * (height / step)) as u64));
        group.bench_function(format!("12 captures {width}x{height}, pixel step {step}"), |bencher| {
            bencher.iter(|| calibrate_planes(&captures, &[None], &camera, 5.0, &options).unwrap());
        });
    }
}

/// An oblique wall with the range errors of the model but the hyperbola's and some scatter.
fn wavy_wall(camera: &Camera, pose: &Isometry3<f64>) -> RangeFrame {
    let wall = Plane::new(&Vector3::new(0.2, 0.1, 1.0), &Point3::new(0.0, 0.0, -5.5)).unwrap();
    let (width, height) = (camera.format.width, camera.format.height);
    let range = |col: usize, row: usize| {
        let scatter = 0.01 * (((col * 37 + row * 101) % 997) as f64 / 997.0 - 0.5);
        wall.reference_range(camera, pose, [col as f64, row as f64]).unwrap().0 + scatter
    };
    let mut frame = RangeFrame {
        range: Raster::from_fn(width, height, |col, row| range(col, row) as f32),
        sigma: Raster::filled(width, height, 0.003),
        amplitude: Raster::filled(width, height, 100.0),
        flags: Raster::filled(width, height, Flags::empty()),
    };
    let model = RangeErrorModel { hyperbola: None, ..model() };
    distort_frame(&mut frame, &model, &camera.format, [0.0; 2], None).unwrap();
    frame
}

fn estimation(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("estimate_range_terms");
    for count in [4_000, 40_000] {
        group.throughput(Throughput::Elements(count as u64));
        let differences: Vec<RangeDifference> = (0..count).map(difference).collect();
        for (name, options) in [
            ("terms", RangeTermOptions::default()),
            ("terms and hyperbola", RangeTermOptions::default().hold("d0", 0.02).unwrap().with_hyperbola()),
        ] {
            group.bench_function(format!("{name}, {count} differences"), |bencher| {
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
    targets = frames, estimation, unknown_plane
}
criterion_main!(benches);
