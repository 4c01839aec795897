//! Time of a calibration from files: the committed field of targets, tables in, results out.

#![allow(missing_docs)] // criterion_group! makes a public function

use std::path::Path;

use calibration_tasks::{
    CalibrateMethod, CalibrateRequest, CalibrationOptions, CertificateRequest, Method, OffsetModel, TableDefaults,
    calibrate,
};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use pipeline::{DriftTreatment, Silent};

fn target_field(criterion: &mut Criterion) {
    let Ok(folder) = tempfile::tempdir() else { return };
    let request = CalibrateRequest {
        survey: Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/surveys/target_field"),
        lens_survey: None,
        calibration: None,
        method: CalibrateMethod::Network(Method::OneStep),
        options: CalibrationOptions::default(),
        offset: OffsetModel::Constant,
        warm_up: DriftTreatment::Apply,
        defaults: TableDefaults::default(),
        certificate: CertificateRequest::default(),
        out: folder.path().join("out"),
    };
    let mut group = criterion.benchmark_group("calibrate");
    // Two image coordinates and a range of each sighting.
    group.sample_size(10).throughput(Throughput::Elements(3 * 661));
    group.bench_function("target_field", |bencher| bencher.iter(|| calibrate(&request, &Silent)));
    group.finish();
}

criterion_group!(all, target_field);
criterion_main!(all);
