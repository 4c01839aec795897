//! Points a second into an octree.
#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};

use cloud_tiles::{TileOptions, write_tiles};

const POINTS: u32 = 200_000;

fn tiles(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().unwrap();
    let (from, to) = (folder.path().join("cloud.ply"), folder.path().join("cloud.copc.laz"));
    let head = "ply\nformat binary_little_endian 1.0\nelement vertex 200000\nproperty float x\nproperty float y\nproperty float z\n\
                property float sigma\nend_header\n";
    let mut bytes = head.as_bytes().to_vec();
    for index in 0..POINTS {
        let [u, v] = [0.754_877_7, 0.569_840_3].map(|step: f64| (f64::from(index) * step).fract());
        let noise = (f64::from(index) * 12.9898).sin() * 1e-3;
        for value in [6.0 * u, 4.0 * v, noise, 1e-3] {
            bytes.extend((value as f32).to_le_bytes());
        }
    }
    std::fs::write(&from, bytes).unwrap();
    let mut group = criterion.benchmark_group("tiles");
    group.throughput(Throughput::Elements(u64::from(POINTS))).sample_size(10);
    group.bench_function("a noisy wall", |bench| {
        bench.iter(|| write_tiles(&from, &to, &TileOptions::default()).unwrap());
    });
    group.finish();
}

criterion_group!(benches, tiles);
criterion_main!(benches);
