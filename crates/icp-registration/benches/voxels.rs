//! Time of voxel averages, of preparing a cloud and of one alignment, for a wavy wall seen twice.

#![allow(missing_docs)] // criterion_group! makes a public function

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use icp_registration::{VoxelAlignmentOptions, VoxelCloud, downsample};
use nalgebra::{Isometry3, Point3, Vector3};
use point_cloud::Cloud;

const SIZES: [(usize, usize); 3] = [(176, 144), (640, 480), (1024, 1024)];

/// A wall at 3 m with waves in both directions, in the camera's frame, metre.
fn wall(width: usize, height: usize) -> Cloud {
    let pixel = |k: usize| {
        let x = ((k % width) as f64 / width as f64 - 0.5) * 1.2;
        let y = ((k / width) as f64 / height as f64 - 0.5) * 1.2;
        let depth = 3.0 + 0.2 * (4.0 * x).sin() + 0.15 * (5.0 * y).cos();
        Point3::new(x * depth, y * depth, -depth)
    };
    Cloud::new((0..width * height).map(pixel).collect())
}

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("Register");
    group.sample_size(10);
    for (width, height) in SIZES {
        let name = format!("{width}x{height}");
        group.throughput(Throughput::Elements((width * height) as u64));
        let target = wall(width, height);
        let source =
            target.transformed(&Isometry3::new(Vector3::new(0.03, -0.02, 0.01), Vector3::new(0.01, 0.02, -0.01)));
        group.bench_function(BenchmarkId::new("downsample", &name), |b| b.iter(|| downsample(&target, 0.05)));
        group.bench_function(BenchmarkId::new("VoxelCloud::new", &name), |b| {
            b.iter(|| VoxelCloud::new(&target, None));
        });
        let prepare = |cloud| VoxelCloud::new(cloud, None);
        let (Ok(target), Ok(source)) = (prepare(&target), prepare(&source)) else { continue };
        group.bench_function(BenchmarkId::new("VoxelCloud::align", &name), |b| {
            b.iter(|| target.align(&source, &Isometry3::identity(), &VoxelAlignmentOptions::default()));
        });
    }
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
