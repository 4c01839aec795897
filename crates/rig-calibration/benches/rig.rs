//! The calibration of a rig of two range cameras and a grey one before 48 targets at 12 epochs.
#![allow(missing_docs, dead_code, clippy::unwrap_used)]

#[path = "../tests/support/rigs.rs"]
mod rigs;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rig_calibration::calibrate_rig;

fn rig(criterion: &mut Criterion) {
    let (rig, options) = (rigs::observed(1, 0.0), rigs::options(rigs::TERMS));
    let sightings: usize = rig.cameras.iter().map(|camera| camera.network.sightings.len()).sum();
    let mut group = criterion.benchmark_group("calibrate_rig");
    group.sample_size(10).throughput(Throughput::Elements(sightings as u64));
    group.bench_function("three_cameras", |bencher| bencher.iter(|| calibrate_rig(&rig, &options).unwrap()));
    group.finish();
}

criterion_group!(benches, rig);
criterion_main!(benches);
