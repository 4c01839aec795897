//! Reading a pipeline from RON, with its checks.
#![allow(missing_docs)]

use std::hint::black_box;
use std::path::Path;

use commands::plan::Plan;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

fn plan(criterion: &mut Criterion) {
    let text = include_str!("../../../fixtures/pipelines/room.ron");
    let mut group = criterion.benchmark_group("Plan");
    group.throughput(Throughput::Bytes(text.len() as u64));
    group.bench_function("room", |bencher| bencher.iter(|| Plan::from_ron(black_box(text), Path::new("room.ron"))));
    group.finish();
}

criterion_group!(benches, plan);
criterion_main!(benches);
