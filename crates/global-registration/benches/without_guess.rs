//! Time of preparing a frame for an alignment without a guess, and of the alignment.

#![allow(missing_docs)] // criterion_group! makes a public function

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use global_registration::{CoarseOptions, FeatureCloud, align_without_guess};
use nalgebra::{Isometry3, Vector3};
use point_cloud::Cloud;

const SIZES: [(usize, usize); 2] = [(176, 144), (640, 480)];

/// A wall at 3 m with steps and waves in the camera's frame, metre.
fn frame(width: usize, height: usize) -> Vec<[f64; 3]> {
    let pixel = |k: usize| {
        let x = ((k % width) as f64 / width as f64 - 0.5) * 1.2;
        let y = ((k / width) as f64 / height as f64 - 0.5) * 1.2;
        let step = if x > 0.1 && y > -0.2 { 0.5 } else { 0.0 };
        let depth = 3.0 + 0.2 * (4.0 * x).sin() + 0.15 * (5.0 * y).cos() - step;
        [x * depth, y * depth, -depth]
    };
    (0..width * height).map(pixel).collect()
}

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("align_without_guess");
    group.sample_size(10);
    let options = CoarseOptions::default();
    for (width, height) in SIZES {
        let size = format!("{width}x{height}");
        group.throughput(Throughput::Elements((width * height) as u64));
        let Ok(cloud) = Cloud::from_frame(&frame(width, height), None, None) else { continue };
        group.bench_function(BenchmarkId::new("prepare", &size), |bencher| {
            bencher.iter(|| FeatureCloud::new(&cloud, &options));
        });
        let Ok(target) = FeatureCloud::new(&cloud, &options) else { continue };
        let moved = Isometry3::new(Vector3::new(0.3, -0.2, 0.1), Vector3::new(0.1, 0.2, -0.1));
        let Ok(source) = FeatureCloud::new(&cloud.transformed(&moved), &options) else { continue };
        group.bench_function(BenchmarkId::new("align", &size), |bencher| {
            bencher.iter(|| align_without_guess(&source, &target, &options));
        });
    }
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
