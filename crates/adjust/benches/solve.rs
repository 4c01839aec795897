//! Self-calibrations of a range camera in free networks, one of a laboratory and one of a hall; and a regression.
#![allow(missing_docs, clippy::unwrap_used)]

#[path = "../tests/common/range_camera.rs"]
#[allow(dead_code)]
mod range_camera;

use adjust::{Adjustment, Covariance, LinearObservation, ParameterBlock, Scale, Solution, SolveOptions};
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use range_camera::{HALL, LABORATORY, RangeCameraPlan, range_camera_network};

fn calibration(criterion: &mut Criterion, name: &str, plan: &RangeCameraPlan) {
    // One thread: wall time is CPU time.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let network = range_camera_network(plan).free();
    let options = SolveOptions::default();
    let solve = || network.adjustment.solve(&options).unwrap();
    let blocks = || network.stations.iter().chain(&network.targets).chain([&network.parameters]);
    let mut group = criterion.benchmark_group(name);
    group.sample_size(10);
    group.bench_function("solve", |b| b.iter(|| pool.install(solve)));
    // A clone of a fresh solution has computed nothing yet.
    let fresh = solve();
    let trace = |solution: &Solution| -> f64 {
        blocks().map(|&block| solution.covariance(block, Scale::Prior).unwrap().trace()).sum()
    };
    group.bench_function("covariances of all blocks", |b| {
        b.iter_batched(|| fresh.clone(), |solution| pool.install(|| trace(&solution)), BatchSize::PerIteration);
    });
    let known = fresh.clone();
    known.covariance(network.parameters, Scale::Prior).unwrap();
    group.bench_function("redundancy numbers", |b| {
        let numbers = |solution: Solution| pool.install(|| solution.redundancy_numbers());
        b.iter_batched(|| known.clone(), numbers, BatchSize::PerIteration);
    });
    group.finish();
}

fn networks(criterion: &mut Criterion) {
    calibration(criterion, "network of 470 unknowns, 3078 values", &LABORATORY);
    calibration(criterion, "network of 7487 unknowns, 234534 values", &HALL);
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

criterion_group!(benches, networks, line);
criterion_main!(benches);
