//! Time of one frame of a stream, in pixels a second, for a wavy wall passed by.

#![allow(missing_docs)] // criterion_group! makes a public function

use std::sync::Arc;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{Isometry3, Point3, Vector3};
use projective_registration::Projection;
use tracking::{Tracker, TrackerOptions};

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
    let mut group = criterion.benchmark_group("Tracker");
    for (width, height) in SIZES {
        let centre = [width as f64 / 2.0, height as f64 / 2.0];
        let Ok(projection) = Projection::pinhole(width, height, [width as f64; 2], centre).map(Arc::new) else {
            continue;
        };
        let Ok(mut tracker) = Tracker::new(&projection, TrackerOptions::default()) else { continue };
        // To and fro, so that the stream has no end.
        let pose = |k: i32| Isometry3::new(Vector3::new(0.01 * f64::from(k), 0.0, 0.0), Vector3::zeros());
        let frames: Vec<Vec<[f64; 3]>> = (0_i32..8).map(|k| frame(width, height, &pose((k - 4).abs()))).collect();
        let mut count = 0_usize;
        group.throughput(Throughput::Elements((width * height) as u64));
        group.bench_function(format!("track/{width}x{height}"), |bencher| {
            bencher.iter(|| {
                count += 1;
                tracker.track(count as f64 / 30.0, &frames[count % frames.len()], None, None).is_ok()
            });
        });
    }
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
