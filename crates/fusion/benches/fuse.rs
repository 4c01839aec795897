//! A million points of six stations in a room, and fewer.

#![allow(clippy::unwrap_used, missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use fusion::{CommonErrorUse, FusionOptions, fuse};

#[path = "../tests/common/mod.rs"]
mod common;

use common::survey::{Plan, Survey};

fn rooms(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("fuse");
    group.sample_size(10);
    for size in [(176, 144), (480, 360)] {
        let survey = Survey::new(&Plan { size, ..Plan::default() }, 1);
        group.throughput(Throughput::Elements(survey.points.len() as u64));
        for common_errors in [CommonErrorUse::Estimate, CommonErrorUse::AsStated] {
            let options = FusionOptions { common_errors, ..FusionOptions::default() };
            let name = BenchmarkId::new(format!("{common_errors:?}"), survey.points.len());
            group.bench_function(name, |bencher| {
                bencher.iter(|| fuse(&survey.registered(), &survey, &survey.common, &options).unwrap());
            });
        }
    }
    group.finish();
}

criterion_group!(benches, rooms);
criterion_main!(benches);
