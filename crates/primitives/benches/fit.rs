//! A plane fitted to frames.
#![allow(missing_docs, clippy::unwrap_used)]

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use primitives::{PrimitiveKind, PrimitiveOptions, fit_primitive};
use range_image::{Flags, RangeFrame, Raster};

fn fit(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("fit_primitive");
    group.sample_size(10);
    for [width, height] in [[176, 144], [640, 480]] {
        let format = ImageFormat::new(width, height, [7.0 / width as f64; 2]).unwrap();
        let interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 };
        let camera = Camera::new(format, interior, LensDistortion::default()).unwrap();
        let noise = |col: usize, row: usize| 0.005 * (1.7 * col as f64 + 23.1 * (row as f64).sin()).sin();
        let range = Raster::from_fn(width, height, |col, row| {
            (-3.0 / camera.ray([col as f64, row as f64]).z + noise(col, row)) as f32
        });
        let frame = RangeFrame {
            range,
            sigma: Raster::filled(width, height, 0.004),
            amplitude: Raster::filled(width, height, 100.0),
            flags: Raster::filled(width, height, Flags::empty()),
        };
        group.throughput(Throughput::Elements((width * height) as u64));
        group.bench_function(BenchmarkId::new("plane", format!("{width}x{height}")), |bencher| {
            bencher
                .iter(|| fit_primitive(&frame, &camera, PrimitiveKind::Plane, &PrimitiveOptions::default()).unwrap());
        });
    }
    group.finish();
}

criterion_group!(benches, fit);
criterion_main!(benches);
