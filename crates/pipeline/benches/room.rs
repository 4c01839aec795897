//! Time of the whole way from raw samples to a registered cloud, without files: the small room.

#![allow(missing_docs)] // criterion_group! makes a public function

use std::path::{Path, PathBuf};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use pipeline::{Plan, Silent, SimulateSource, Source};

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/pipelines")
}

fn room(criterion: &mut Criterion) {
    let file = fixtures().join("room_small.ron");
    let (Ok(plan), Ok(folder)) = (Plan::read(&file), tempfile::tempdir()) else { return };
    let Some(Source::Simulate(source)) = &plan.source else { return };
    let source: &SimulateSource = source;
    let survey = folder.path().join("survey");
    if pipeline::simulate(source, &fixtures(), &survey, &Silent).is_err() {
        return;
    }
    let mut group = criterion.benchmark_group("process");
    // Eight stations of four frames of 132 x 108 pixels.
    group.sample_size(10).throughput(Throughput::Elements(8 * 4 * 132 * 108));
    group.bench_function("room_small", |bencher| bencher.iter(|| pipeline::process(&plan, &survey, None, &Silent)));
    group.finish();
}

criterion_group!(all, room);
criterion_main!(all);
