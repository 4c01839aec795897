//! Transforms of an image's lines in single and in double precision, in numbers a second.

#![allow(missing_docs)] // criterion_group! makes a public function

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use fourier_transforms::num_complex::Complex;
use fourier_transforms::{DoublePlanner, FftDirection, SinglePlanner};

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("transforms");
    for [length, lines] in [[192, 144], [800, 480], [1280, 1024]] {
        group.throughput(Throughput::Elements((length * lines) as u64));
        let single = SinglePlanner::new().plan(length, FftDirection::Forward);
        let double = DoublePlanner::new().plan(length, FftDirection::Forward);
        let size = format!("{length}x{lines}");
        group.bench_function(BenchmarkId::new("single", &size), |bencher| {
            let mut image = vec![Complex::new(0.0, 0.0); length * lines];
            bencher.iter(|| single.process(&mut image));
        });
        group.bench_function(BenchmarkId::new("double", &size), |bencher| {
            let mut image = vec![Complex::new(0.0, 0.0); length * lines];
            bencher.iter(|| double.process(&mut image));
        });
    }
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
