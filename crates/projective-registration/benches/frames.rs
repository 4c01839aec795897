//! Time of the preparation of a frame and of the registration of two, for a wavy wall seen twice.

#![allow(missing_docs)] // criterion_group! makes a public function

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{Isometry3, Point3, Vector3};
use projective_registration::{FrameAligner, FrameAlignmentOptions, OrganisedFrame, Projection};

const SIZES: [(usize, usize); 3] = [(176, 144), (640, 480), (1024, 1024)];

/// How far a ray (u, v, -1) leads from a camera to the wall z = -3 + waves, by fixed-point iteration, as a point.
fn seen(world_from_camera: &Isometry3<f64>, u: f64, v: f64) -> [f64; 3] {
    let mut depth = 3.0;
    for _ in 0..20 {
        let p = world_from_camera * Point3::new(u * depth, v * depth, -depth);
        depth += p.z + 3.0 + 0.1 * (1.5 * p.x).sin() + 0.08 * (2.0 * p.y).cos();
    }
    [u * depth, v * depth, -depth]
}

fn frame(width: usize, height: usize, pose: &Isometry3<f64>) -> Vec<[f64; 3]> {
    let (across, up) = (width as f64 / 2.0, height as f64 / 2.0);
    let ray = |k: usize| [((k % width) as f64 - across) / width as f64, (up - (k / width) as f64) / width as f64];
    (0..width * height).map(ray).map(|[u, v]| seen(pose, u, v)).collect()
}

fn benches(criterion: &mut Criterion) {
    let moved = Isometry3::new(Vector3::new(0.05, -0.04, 0.03), Vector3::new(0.02, 0.03, -0.02));
    let mut group = criterion.benchmark_group("Register");
    for (width, height) in SIZES {
        group.throughput(Throughput::Elements((width * height) as u64));
        let focal = [width as f64; 2];
        let centre = [width as f64 / 2.0, height as f64 / 2.0];
        let Ok(projection) = Projection::pinhole(width, height, focal, centre).map(Arc::new) else { continue };
        let points = frame(width, height, &moved);
        let Ok(target) = OrganisedFrame::new(&projection, &frame(width, height, &Isometry3::identity()), None) else {
            continue;
        };
        let Ok(mut source) = OrganisedFrame::new(&projection, &points, None) else { continue };
        let Ok(mut aligner) = FrameAligner::new(FrameAlignmentOptions::default()) else { continue };
        let size = format!("{width}x{height}");
        group.bench_function(format!("OrganisedFrame::update/{size}"), |bencher| {
            bencher.iter(|| source.update(black_box(&points), None));
        });
        group.bench_function(format!("FrameAligner::align/{size}"), |bencher| {
            bencher.iter(|| aligner.align(black_box(&source), &target, &Isometry3::identity()));
        });
    }
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
