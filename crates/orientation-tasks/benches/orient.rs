//! Fourteen stations by targets, from files to files.
#![allow(missing_docs, clippy::unwrap_used)]

use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use orientation_tasks::pipeline::Silent;
use orientation_tasks::{OrientBy, OrientRequest, orient};

fn by_targets(criterion: &mut Criterion) {
    let survey = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/surveys/target_field");
    let folder = tempfile::tempdir().unwrap();
    let request = OrientRequest {
        calibration: Some(survey.join("truth/calibration.ron")),
        survey,
        by: OrientBy::Targets { sigma_pixel: None, sigma_range_m: None },
        out: folder.path().join("out"),
    };
    let mut group = criterion.benchmark_group("orient");
    group.sample_size(10);
    group.throughput(Throughput::Elements(14));
    group.bench_function("targets", |bencher| bencher.iter(|| orient(&request, &Silent).unwrap()));
    group.finish();
}

criterion_group!(benches, by_targets);
criterion_main!(benches);
