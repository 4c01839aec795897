//! Self-calibration of the normal network, 24 stations over 103 targets, from start values found to the outcome.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]

#[path = "../tests/support/mod.rs"]
mod support;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use self_calibration::{
    CalibrationOptions, SightingOptions, SimulatedStart, TermSelection, calibrate, simulate_sightings,
};
use support::networks::{all_but_long_wave, nominal, normal};

fn networks(criterion: &mut Criterion) {
    let sightings = SightingOptions { start: SimulatedStart::Absent, ..SightingOptions::default() };
    let mut observed = simulate_sightings(&normal(), &sightings).unwrap();
    nominal(&mut observed);
    let listed = TermSelection::List(all_but_long_wave());
    let mut group = criterion.benchmark_group("calibrate");
    group.sample_size(10).throughput(Throughput::Elements(3 * observed.sightings.len() as u64));
    for (name, terms, rejection_level) in [
        ("one step", listed.clone(), None),
        ("one step, gross errors looked for", listed, Some(1e-4)),
        ("one step, gross errors looked for, terms chosen", TermSelection::Auto, Some(1e-4)),
    ] {
        let options = CalibrationOptions { terms, rejection_level, ..CalibrationOptions::default() };
        group.bench_function(name, |bencher| bencher.iter(|| calibrate(&observed, &options).unwrap()));
    }
    group.finish();
}

criterion_group!(benches, networks);
criterion_main!(benches);
