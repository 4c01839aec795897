//! Time of a registration from files: the small room, survey in, results out.

#![allow(missing_docs)] // criterion_group! makes a public function

use std::path::{Path, PathBuf};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use pipeline::{Silent, SimulateSource, simulate};
use tasks::{RegisterMethod, RegisterRequest, register};

fn scenes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/scenes")
}

fn room(criterion: &mut Criterion) {
    let Ok(folder) = tempfile::tempdir() else { return };
    let survey = folder.path().join("survey");
    let source = SimulateSource {
        scene: "room_small.ron".to_owned(),
        seed: 1,
        approximate_position_sigma_m: 0.0,
        approximate_attitude_sigma_deg: 0.0,
        gross_error_share: 0.0,
    };
    if simulate(&source, &scenes(), &survey, &Silent).is_err() {
        return;
    }
    let request = RegisterRequest {
        inputs: vec![survey],
        method: RegisterMethod::Multi,
        guess: None,
        calibration: None,
        out: folder.path().join("out"),
    };
    let mut group = criterion.benchmark_group("register");
    // Eight stations of four frames of 132 x 108 pixels.
    group.sample_size(10).throughput(Throughput::Elements(8 * 4 * 132 * 108));
    group.bench_function("room_small", |bencher| bencher.iter(|| register(&request, &Silent)));
    group.finish();
}

criterion_group!(all, room);
criterion_main!(all);
