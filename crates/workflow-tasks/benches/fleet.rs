//! The report of a fleet, by its recordings: what is read of each are two small files.
#![allow(missing_docs)]

use std::fs;
use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use workflow_tasks::{FleetRequest, fleet};

const RECORDINGS: usize = 200;

fn write(file: &Path, text: &str) -> std::io::Result<()> {
    if let Some(folder) = file.parent() {
        fs::create_dir_all(folder)?;
    }
    fs::write(file, text)
}

fn bench(c: &mut Criterion) {
    let Ok(folder) = tempfile::tempdir() else { return };
    let summary = r#"{"frames": 32, "stations": 8, "points": 100000, "flags_fraction": {"any": 0.2, "mixed_pixel": 0.1}, "doubts": []}"#;
    for number in 0..RECORDINGS {
        let step = format!("camera/day/recordings/r{number}");
        let written = [("codes", ".code", "0\n"), ("results", "/summary.json", summary)]
            .iter()
            .try_for_each(|(kind, ending, text)| write(&folder.path().join(format!("{kind}/{step}{ending}")), text));
        if written.is_err() {
            return;
        }
    }
    let request = FleetRequest { folder: folder.path().to_owned(), out: folder.path().join("fleet") };
    let mut group = c.benchmark_group("fleet");
    group.throughput(Throughput::Elements(RECORDINGS as u64));
    group.bench_function("200 recordings", |b| b.iter(|| fleet(&request)));
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
