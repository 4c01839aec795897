//! Time of reading a `rig.ron`.
#![allow(missing_docs)] // criterion_group! makes a public function

use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rig_tasks::RigFile;

fn rig_file(criterion: &mut Criterion) {
    let text = "(cameras: [(name: \"left\"), (name: \"right\"), (name: \"grey\", folder: \"passive\", terms: [])])";
    let mut group = criterion.benchmark_group("RigFile");
    group.throughput(Throughput::Bytes(text.len() as u64));
    group.bench_function("parse", |bencher| bencher.iter(|| RigFile::parse(Path::new("rig.ron"), text)));
    group.finish();
}

criterion_group!(all, rig_file);
criterion_main!(all);
