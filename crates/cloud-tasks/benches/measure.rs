//! A plan of all kinds of lengths, from files to files.

#![allow(missing_docs, clippy::unwrap_used)]

use cloud_tasks::commands::Silent;
use cloud_tasks::commands::range_io::clouds::{CloudFile, Precision};
use cloud_tasks::commands::range_io::ply::write_cloud;
use cloud_tasks::{MeasureRequest, measure};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

const SIDE: usize = 500;

fn cloud() -> CloudFile {
    let at = |k: usize| [(k % SIDE) as f64 / SIDE as f64, (k / SIDE) as f64 / SIDE as f64];
    let height = |k: usize| if k % SIDE < SIDE / 2 { 0.0 } else { 0.2 } + 0.002 * (k as f64 * 12.9898).sin();
    let count = SIDE * SIDE;
    CloudFile {
        points: (0..count).map(|k| [at(k)[0], at(k)[1], height(k)]).collect(),
        sigma: Some(vec![0.0015; count]),
        ..CloudFile::default()
    }
}

const PLAN: &str = r#"(
    regions: {
        "low": plane(box(from_m: (0.1, 0.1, -0.1), to_m: (0.4, 0.9, 0.1))),
        "high": plane(box(from_m: (0.6, 0.1, 0.1), to_m: (0.9, 0.9, 0.3))),
        "block": surface(box(from_m: (0.6, 0.1, 0.1), to_m: (0.9, 0.9, 0.3))),
    },
    lengths: [
        (name: "step", quantity: distance(from: "low", to: "high")),
        (name: "lean", quantity: angle(from: "low", to: "high")),
        (name: "form", quantity: flatness(of: "high")),
        (name: "volume", quantity: volume(of: "block", over: "low")),
    ],
)"#;

fn lengths(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::create_dir(path("result")).unwrap();
    write_cloud(path("result/cloud.ply"), &cloud(), Precision::Single).unwrap();
    std::fs::write(path("lengths.ron"), PLAN).unwrap();
    let request = MeasureRequest { result: path("result"), lengths: path("lengths.ron"), out: path("out") };
    let mut group = criterion.benchmark_group("measure");
    group.sample_size(10);
    group.throughput(Throughput::Elements((SIDE * SIDE) as u64));
    group.bench_function("step", |bencher| bencher.iter(|| measure(&request, &Silent).unwrap()));
    group.finish();
}

criterion_group!(benches, lengths);
criterion_main!(benches);
