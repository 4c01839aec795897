//! Ray table, back-projection, what the width of pixels does, and depth-to-range of whole frames; one observation with its derivatives.

#![allow(missing_docs)] // criterion's macro makes a public function

use std::hint::black_box;

use camera_model::{
    Camera, ImageFormat, InteriorOrientation, LensDistortion, OrganisedCloud, RayTable, pose_from_euler,
};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{Point3, Vector3};
use range_image::{Flags, RangeFrame, Raster};

/// From the early time-of-flight sensors to a megapixel.
const SIZES: [(usize, usize); 3] = [(176, 144), (640, 480), (1024, 1024)];

/// The same optics for each size: an image 7 mm wide behind an 8 mm lens.
fn camera(width: usize, height: usize) -> Result<Camera, camera_model::Error> {
    let pitch = 7.04 / width as f64;
    let interior = InteriorOrientation { principal_point_mm: [0.11, -0.07], principal_distance_mm: 8.0 };
    let lens =
        LensDistortion { k1: -2.1e-3, k2: 3.0e-5, k3: -4.0e-7, p1: 1.2e-4, p2: -0.8e-4, ..LensDistortion::default() };
    Camera::new(ImageFormat::new(width, height, [pitch, pitch])?, interior, lens)
}

fn frame(width: usize, height: usize) -> RangeFrame {
    RangeFrame {
        range: Raster::from_fn(width, height, |col, row| 1.0 + 0.001 * (col + row) as f32),
        sigma: Raster::filled(width, height, 0.004),
        amplitude: Raster::filled(width, height, 700.0),
        flags: Raster::filled(width, height, Flags::empty()),
    }
}

fn frames(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("PointCloud");
    for (width, height) in SIZES {
        let Ok(camera) = camera(width, height) else { continue };
        let Ok(table) = RayTable::new(&camera) else { continue };
        let frame = frame(width, height);
        let size = format!("{width}x{height}");
        group.throughput(Throughput::Elements((width * height) as u64));
        group.bench_function(BenchmarkId::new("ray_table", &size), |b| b.iter(|| RayTable::new(black_box(&camera))));
        let mut cloud = OrganisedCloud::default();
        group.bench_function(BenchmarkId::new("back_project_into", &size), |b| {
            b.iter(|| table.back_project_into(black_box(&frame), &mut cloud));
        });
        // Of the same size where the one before was not run.
        if table.back_project_into(&frame, &mut cloud).is_err() {
            continue;
        }
        group.bench_function(BenchmarkId::new("footprints", &size), |b| {
            b.iter(|| table.footprints(black_box(&cloud), Flags::all()));
        });
        let mut plane = frame.range.clone();
        group.bench_function(BenchmarkId::new("range_to_depth_in_place", &size), |b| {
            b.iter(|| table.range_to_depth_in_place(black_box(&mut plane)));
        });
    }
    group.finish();
}

fn observations(criterion: &mut Criterion) {
    let Ok(camera) = camera(176, 144) else { return };
    let pose = pose_from_euler(Vector3::new(1.0, 2.0, 3.0), [0.1, -0.2, 0.05]);
    let point: Point3<f64> = pose * Point3::new(0.7, -0.4, -2.5);
    let mut group = criterion.benchmark_group("observe");
    group.throughput(Throughput::Elements(1));
    group.bench_function("value", |b| b.iter(|| camera.observe(black_box(&pose), black_box(&point))));
    group.bench_function("with Jacobians", |b| {
        b.iter(|| camera.observe_with_jacobians(black_box(&pose), black_box(&point)));
    });
    group.finish();
}

criterion_group!(benches, frames, observations);
criterion_main!(benches);
