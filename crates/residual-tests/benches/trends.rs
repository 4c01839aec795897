//! Tests of residuals for trends.
#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use residual_tests::{TrendOptions, TrendSample, test_trends};

fn trends(criterion: &mut Criterion) {
    let mut random = Pcg64::seed_from_u64(1);
    let mut sample = |index: usize| {
        let (frame, pixel) = (index / 6336, index % 6336);
        let noise: f64 = StandardNormal.sample(&mut random);
        TrendSample {
            residual_m: 0.002 * noise,
            sigma_m: 0.002,
            range_m: 1.0 + 0.3 * frame as f64 + 0.01 * (pixel % 88) as f64,
            amplitude: 100.0 / (1.0 + frame as f64),
            column: (pixel % 88) as f64,
            row: (pixel / 88) as f64,
            time_s: frame as f64,
            frame,
        }
    };
    let samples: Vec<TrendSample> = (0..20 * 6336).map(&mut sample).collect();
    let mut group = criterion.benchmark_group("test_trends");
    group.sample_size(10).throughput(Throughput::Elements(samples.len() as u64));
    group.bench_function("20 frames of 88x72", |bencher| {
        bencher.iter(|| test_trends(&samples, &TrendOptions::default()).unwrap());
    });
    group.finish();
}

criterion_group!(benches, trends);
criterion_main!(benches);
