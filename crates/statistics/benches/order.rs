//! Medians, scales and quantiles of distributions.
#![allow(missing_docs)]

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use statistics::{Distribution, mad_scale, quantile, upper_median};

fn order(criterion: &mut Criterion) {
    // The fractional parts of multiples of the golden ratio: evenly spread, in no order.
    let values: Vec<f64> = (1..=176 * 144).map(|k| (f64::from(k) * 0.618_033_988_749_894_9).fract()).collect();
    let mut group = criterion.benchmark_group("order");
    group.throughput(Throughput::Elements(values.len() as u64));
    let mut of = |name: &str, value: fn(&mut [f64]) -> f64| {
        group.bench_function(name, |bencher| {
            bencher.iter_batched_ref(|| values.clone(), |values| value(values), BatchSize::LargeInput);
        });
    };
    of("upper median of 176x144", upper_median);
    of("interpolated median of 176x144", |values| quantile(values, 0.5));
    of("scale of 176x144", mad_scale);
    group.finish();
    let mut group = criterion.benchmark_group("Distribution");
    group.throughput(Throughput::Elements(1));
    group.bench_function("upper quantile of chi-squared", |bencher| {
        bencher.iter(|| Distribution::ChiSquared { dof: 7.0 }.upper_quantile(1e-3));
    });
    group.finish();
}

criterion_group!(benches, order);
criterion_main!(benches);
