//! Preintegration of an interval of 20 and of 200 samples, and a sequence of 20 camera poses.
#![allow(missing_docs)] // criterion's macro makes a public function

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use inertial::nalgebra::{Isometry3, Matrix6, Vector3};
use inertial::rigid_pose::Uncertain;
use inertial::{Biases, CameraPose, ImuNoise, InertialSample, Preintegrated, SequenceOptions, estimate_sequence};

fn swing(t: f64) -> Isometry3<f64> {
    Isometry3::rotation(Vector3::new(0.3 * t.sin(), 0.2 * (2.0 * t).sin(), 0.1 * (3.0 * t).sin()))
}

fn samples(count: usize) -> Vec<InertialSample> {
    let sample = |k: usize| {
        let t = k as f64 * 0.005;
        let turn = (swing(t - 1e-4).rotation.inverse() * swing(t + 1e-4).rotation).scaled_axis();
        let specific_force = swing(t).rotation.inverse() * Vector3::new(0.0, 9.80665, 0.0);
        InertialSample { timestamp_s: t, angular_rate: turn / 2e-4, specific_force }
    };
    (0..=count).map(sample).collect()
}

fn preintegrated(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("preintegrated");
    for count in [20, 200] {
        let samples = samples(count);
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(BenchmarkId::new("new", count), |b| {
            let interval = [0.0, count as f64 * 0.005];
            b.iter(|| Preintegrated::new(black_box(&samples), interval, &Biases::zero(), &ImuNoise::default()));
        });
    }
    let samples = samples(400);
    let pose = |k: usize| {
        let time_s = k as f64 * 0.1;
        CameraPose { time_s, pose: Uncertain { pose: swing(time_s), covariance: Matrix6::identity() * 1e-6 } }
    };
    let poses: Vec<_> = (0..20).map(pose).collect();
    group.throughput(Throughput::Elements(20));
    group.bench_function("estimate_sequence", |b| {
        b.iter(|| estimate_sequence(black_box(&poses), &samples, &SequenceOptions::default()));
    });
    group.finish();
}

criterion_group!(benches, preintegrated);
criterion_main!(benches);
