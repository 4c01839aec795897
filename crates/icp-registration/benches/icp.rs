//! Time of one alignment, for a wavy wall seen twice.

#![allow(missing_docs)] // criterion_group! makes a public function

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use icp_registration::{IcpOptions, IcpTarget, Selection};
use nalgebra::{Isometry3, Vector3};
use point_cloud::{Cloud, OrganisedNormalOptions, organised_normals};

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
    let mut icp = criterion.benchmark_group("Register");
    icp.sample_size(10);
    for (width, height) in SIZES {
        let points = frame(width, height);
        let Ok(normals) = organised_normals(&points, width, height, &OrganisedNormalOptions::default()) else {
            continue;
        };
        let Ok(cloud) = Cloud::from_frame(&points, Some(&normals), None) else { continue };
        let Ok(target) = IcpTarget::new(cloud.clone()) else { continue };
        let moved = Isometry3::new(Vector3::new(0.03, -0.02, 0.01), Vector3::new(0.01, 0.02, -0.01));
        let source = cloud.transformed(&moved);
        let options = IcpOptions { selection: Selection::EveryNth(3), ..IcpOptions::default() };
        icp.throughput(Throughput::Elements((width * height) as u64));
        icp.bench_function(BenchmarkId::new("IcpTarget::align", format!("{width}x{height}")), |bencher| {
            bencher.iter(|| target.align(&source, &Isometry3::identity(), &options));
        });
    }
    icp.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
