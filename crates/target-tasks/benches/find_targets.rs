//! Time of a search from files: a simulated survey of a board of discs, tables out.
#![allow(missing_docs)] // criterion_group! makes a public function

use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use pipeline::{Silent, SimulateSource, simulate};
use target_tasks::{TargetKind, TargetsRequest, find_targets};

fn boards(criterion: &mut Criterion) {
    let Ok(folder) = tempfile::tempdir() else { return };
    let survey = folder.path().join("survey");
    let source = SimulateSource {
        scene: "dots.ron".to_owned(),
        seed: 1,
        approximate_position_sigma_m: 0.0,
        approximate_attitude_sigma_deg: 0.0,
        gross_error_share: 0.0,
    };
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/scenes");
    let kind = TargetKind::parse(&["circles", "7x5", "0.4"]);
    let (Ok(kind), Ok(_)) = (kind, simulate(&source, &scenes, &survey, &Silent)) else { return };
    let (calibration, principal_distance_px, board_sigma_m) = (None, None, None);
    let out = folder.path().join("out");
    let request = TargetsRequest { survey, calibration, kind, principal_distance_px, board_sigma_m, out };
    let mut group = criterion.benchmark_group("find_targets");
    // 22 stations of eight frames of 176 x 144 pixels.
    group.sample_size(10).throughput(Throughput::Elements(22 * 8 * 176 * 144));
    group.bench_function("dots", |bencher| bencher.iter(|| find_targets(&request, &Silent)));
    group.finish();
}

criterion_group!(all, boards);
criterion_main!(all);
