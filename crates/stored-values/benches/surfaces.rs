//! The surfaces of a frame.
#![allow(missing_docs, clippy::unwrap_used)]

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion, RayTable};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use range_image::Raster;
use stored_values::{bendings, judge_kind};

fn surfaces(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("judge_kind");
    group.sample_size(10);
    for [width, height] in [[176, 144], [640, 480]] {
        let format = ImageFormat::new(width, height, [7.0 / width as f64; 2]).unwrap();
        let interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 };
        let camera = Camera::new(format, interior, LensDistortion::default()).unwrap();
        let rays = RayTable::new(&camera).unwrap();
        let noise = |col: usize, row: usize| 0.005 * (1.7 * col as f64 + 23.1 * (row as f64).sin()).sin();
        let range = Raster::from_fn(width, height, |col, row| {
            (-3.0 / camera.ray([col as f64, row as f64]).z + noise(col, row)) as f32
        });
        group.throughput(Throughput::Elements((width * height) as u64));
        group.bench_function(BenchmarkId::new("wall", format!("{width}x{height}")), |bencher| {
            bencher.iter(|| judge_kind(&bendings(&range, &rays).unwrap()));
        });
    }
    group.finish();
}

criterion_group!(benches, surfaces);
criterion_main!(benches);
