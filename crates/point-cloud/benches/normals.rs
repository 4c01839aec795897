//! Time of the normals of a frame, in points a second, for a wavy wall.

#![allow(missing_docs)] // criterion_group! makes a public function

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use point_cloud::{OrganisedNormalOptions, organised_normals};

const SIZES: [(usize, usize); 3] = [(176, 144), (640, 480), (1024, 1024)];

/// A wall at 3 m with waves in both directions, in the camera's frame, metre.
fn frame(width: usize, height: usize) -> Vec<[f64; 3]> {
    let pixel = |k: usize| {
        let x = ((k % width) as f64 / width as f64 - 0.5) * 1.2;
        let y = ((k / width) as f64 / height as f64 - 0.5) * 1.2;
        let depth = 3.0 + 0.2 * (4.0 * x).sin() + 0.15 * (5.0 * y).cos();
        [x * depth, y * depth, -depth]
    };
    (0..width * height).map(pixel).collect()
}

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("organised_normals");
    for (width, height) in SIZES {
        let points = frame(width, height);
        group.throughput(Throughput::Elements(points.len() as u64));
        group.bench_function(BenchmarkId::from_parameter(format!("{width}x{height}")), |bencher| {
            bencher.iter(|| organised_normals(&points, width, height, &OrganisedNormalOptions::default()));
        });
    }
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
