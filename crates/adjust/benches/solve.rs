//! Self-calibrations of a range camera in free networks, one of a laboratory and one of a hall; and a regression.
#![allow(missing_docs, clippy::unwrap_used)]

#[path = "../tests/common/range_camera.rs"]
#[allow(dead_code)]
mod range_camera;

use adjust::{Adjustment, Covariance, LinearObservation, ParameterBlock, Scale, Solution, SolveOptions};
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use range_camera::{HALL, LABORATORY, RangeCameraPlan, range_camera_network};

fn calibration(criterion: &mut Criterion, name: &str, plan: &RangeCameraPlan) {
    // One thread: wall time is CPU time.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let network = range_camera_network(plan).free();
    let options = SolveOptions::default();
    let solve = || network.adjustment.solve(&options).unwrap();
    let blocks = || network.stations.iter().chain(&network.targets).chain([&network.parameters]);
    // A clone of a fresh solution has computed nothing yet.
    let fresh = solve();
    let mut group = criterion.benchmark_group("solve");
    group.sample_size(10).throughput(Throughput::Elements(fresh.observations() as u64));
    group.bench_function(name, |b| b.iter(|| pool.install(solve)));
    let trace = |solution: &Solution| -> f64 {
        blocks().map(|&block| solution.covariance(block, Scale::Prior).unwrap().trace()).sum()
    };
    group.bench_function(format!("covariances of all blocks, {name}"), |b| {
        b.iter_batched(|| fresh.clone(), |solution| pool.install(|| trace(&solution)), BatchSize::PerIteration);
    });
    let known = fresh.clone();
    known.covariance(network.parameters, Scale::Prior).unwrap();
    group.bench_function(format!("redundancy numbers, {name}"), |b| {
        let numbers = |solution: Solution| pool.install(|| solution.redundancy_numbers());
        b.iter_batched(|| known.clone(), numbers, BatchSize::PerIteration);
    });
    group.finish();
}

fn networks(criterion: &mut Criterion) {
    calibration(criterion, "470 unknowns", &LABORATORY);
    calibration(criterion, "7487 unknowns", &HALL);
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
    let mut group = criterion.benchmark_group("solve");
    group.throughput(Throughput::Elements(100));
    group.bench_function("line through 100 points", |b| b.iter(|| a.solve(&options).unwrap()));
    group.finish();
}

criterion_group!(benches, networks, line);
criterion_main!(benches);
