//! Time of the closed forms of absolute orientation, in point pairs a second.

#![allow(missing_docs)] // criterion_group! makes a public function

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rigid_pose::nalgebra::{Isometry3, Point3, Vector3};
use rigid_pose::{RotationMethod, absolute_orientation_by};

const PAIRS: u32 = 1000;

fn benches(criterion: &mut Criterion) {
    let pose = Isometry3::new(Vector3::new(0.5, -1.0, 2.0), Vector3::new(0.1, 0.2, -0.3));
    let place = |k: u32| [0.37, 0.71, 0.13].map(|step| f64::from(k) * step % 3.0);
    let source: Vec<Point3<f64>> = (0..PAIRS).map(|k| Point3::from(place(k))).collect();
    let target: Vec<Point3<f64>> = source.iter().map(|point| pose * point).collect();
    let mut group = criterion.benchmark_group("absolute_orientation");
    group.throughput(Throughput::Elements(PAIRS.into()));
    for method in [
        RotationMethod::UnitQuaternion,
        RotationMethod::SingularValues,
        RotationMethod::OrthonormalMatrices,
        RotationMethod::DualQuaternions,
    ] {
        group.bench_function(format!("{method:?}"), |bencher| {
            bencher.iter(|| absolute_orientation_by(method, black_box(&source), &target, None));
        });
    }
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
