//! Steps of poses and robust weights.
#![allow(missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Isometry3, Vector3};
use observation_equations::{Kernel, Manifold, RigidPose};

fn pose(criterion: &mut Criterion) {
    let values = RigidPose::values(&Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.1, 0.2, 0.3)));
    criterion.bench_function("step of a pose", |bencher| {
        let mut out = [0.0; 7];
        bencher.iter(|| RigidPose.plus(black_box(&values), &[0.01; 6], &mut out));
    });
    criterion.bench_function("a thousand robust weights", |bencher| {
        bencher.iter(|| (0..1000).map(|k| Kernel::Cauchy(2.385).evaluate(black_box(f64::from(k))).1).sum::<f64>());
    });
}

criterion_group!(benches, pose);
criterion_main!(benches);
