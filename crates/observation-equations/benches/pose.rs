//! Steps of poses and robust weights.
#![allow(missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{Isometry3, Vector3};
use observation_equations::{Kernel, Manifold, RigidPose};

fn pose(criterion: &mut Criterion) {
    let values = RigidPose::values(&Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.1, 0.2, 0.3)));
    let mut group = criterion.benchmark_group("Manifold::plus");
    group.throughput(Throughput::Elements(1));
    group.bench_function("RigidPose", |bencher| {
        let mut out = [0.0; 7];
        bencher.iter(|| RigidPose.plus(black_box(&values), &[0.01; 6], &mut out));
    });
    group.finish();
    let mut group = criterion.benchmark_group("Kernel::evaluate");
    group.throughput(Throughput::Elements(1000));
    group.bench_function("Cauchy", |bencher| {
        bencher.iter(|| (0..1000).map(|k| Kernel::Cauchy(2.385).evaluate(black_box(f64::from(k))).1).sum::<f64>());
    });
    group.finish();
}

criterion_group!(benches, pose);
criterion_main!(benches);
