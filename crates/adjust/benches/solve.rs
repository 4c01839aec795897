//! A calibration-sized free network: 24 stations, 103 points, 1026 sights of three values, 453 unknowns; and a
//! regression.
#![allow(missing_docs, clippy::unwrap_used)]

#[path = "../tests/common/mod.rs"]
mod common;

use adjust::{Adjustment, Covariance, DatumDefect, LinearObservation, ParameterBlock, Scale, SolveOptions};
use common::{Plan, network};
use criterion::{Criterion, criterion_group, criterion_main};

fn free_network(criterion: &mut Criterion) {
    let plan = Plan { seed: 1, stations: 24, points: 103, seen: 43, ranges: true, disturbance: 0.01 };
    let mut network = network(&plan);
    let points = network.points.clone();
    network.adjustment.add_inner_constraints(&points, DatumDefect::Six).unwrap();
    let options = SolveOptions::default();
    let mut group = criterion.benchmark_group("network of 453 unknowns, 3096 observations");
    group.sample_size(10);
    group.bench_function("solve with covariance", |b| b.iter(|| network.adjustment.solve(&options).unwrap()));
    let solution = network.adjustment.solve(&options).unwrap();
    group.bench_function("redundancy numbers", |b| b.iter(|| solution.redundancy_numbers()));
    group.bench_function("standardised residuals", |b| {
        b.iter(|| solution.standardised_residuals(Scale::Prior).unwrap());
    });
    group.finish();
}

fn line(criterion: &mut Criterion) {
    let mut a = Adjustment::new();
    let line = a.add_block(ParameterBlock::euclidean([0.0, 0.0]));
    let group = a.add_group("heights");
    for i in 0..100 {
        let x = f64::from(i);
        let height = LinearObservation::new(x + (7.0 * x).sin(), [(line, [1.0, x])]);
        a.add_observation(group, height, &Covariance::from_sigma(0.7)).unwrap();
    }
    let options = SolveOptions::default();
    criterion.bench_function("line through 100 points", |b| b.iter(|| a.solve(&options).unwrap()));
}

criterion_group!(benches, free_network, line);
criterion_main!(benches);
