//! Start values, one adjustment and its strength: ten stations over 48 targets.
#![allow(missing_docs, dead_code, clippy::unwrap_used)]

#[path = "../tests/support/mod.rs"]
mod support;

use calibration_network::functional_model::{Datum, Setup};
use calibration_network::{SightingOptions, SimulatedStart, simulate_sightings};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use support::{nominal, strong, terms};

fn network(criterion: &mut Criterion) {
    let sightings = SightingOptions { start: SimulatedStart::Absent, ..SightingOptions::default() };
    let mut observed = simulate_sightings(&strong(), &sightings).unwrap();
    nominal(&mut observed);
    let begin = || {
        let ranged = vec![true; observed.stations.len()];
        let names = terms("xp yp c k1 k2 d0 d4 d5 d6 d7 e1 e2");
        Setup::from_network(&observed, names, ranged, false, Datum::Inner).unwrap()
    };
    let setup = begin();
    let solved = setup.solve().unwrap();
    let mut group = criterion.benchmark_group("Setup");
    group.sample_size(10).throughput(Throughput::Elements(3 * observed.sightings.len() as u64));
    group.bench_function("from_network", |bencher| bencher.iter(begin));
    group.bench_function("solve", |bencher| bencher.iter(|| setup.solve().unwrap()));
    group.bench_function("strength", |bencher| bencher.iter(|| setup.strength(&solved).unwrap()));
    group.finish();
}

criterion_group!(benches, network);
criterion_main!(benches);
