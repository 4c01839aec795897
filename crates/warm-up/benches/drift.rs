//! Estimation of a drift from mean changes of range.
#![allow(missing_docs, clippy::unwrap_used)]

#[path = "../tests/drift_captures.rs"]
mod captures;

use captures::{Capture, transients};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use warm_up::{DriftOptions, estimate_drift};

fn drift(criterion: &mut Criterion) {
    let samples = Capture::new(transients(&[(0.008, 900.0), (0.003, 4000.0)])).samples(1);
    let mut group = criterion.benchmark_group("estimate_drift");
    group.sample_size(10).throughput(Throughput::Elements(samples.len() as u64));
    group.bench_function("two exponentials, a thousand frames", |bencher| {
        bencher.iter(|| estimate_drift(&samples, &DriftOptions::default()).unwrap());
    });
    group.finish();
}

criterion_group!(benches, drift);
criterion_main!(benches);
