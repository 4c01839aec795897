//! Targets found in images.
#![allow(missing_docs, clippy::unwrap_used)]

#[path = "../tests/support/mod.rs"]
mod support;

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use support::cases::case;
use targets::range_image::Raster;
use targets::{Checkerboard, CheckerboardOptions, CircleOptions, find_checkerboard, find_circles};

fn boards(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("find_checkerboard");
    group.sample_size(20);
    for name in ["small_plain", "small_fields", "large_plain"] {
        let case = case(name, 1);
        let board = Checkerboard::new(9, 6, 0.03).unwrap();
        group.throughput(Throughput::Elements(case.image.len() as u64));
        group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
            bencher
                .iter(|| find_checkerboard(black_box(&case.image), &board, &CheckerboardOptions::default()).unwrap());
        });
    }
    group.finish();
}

/// Dots of radius 4 pixels, 16 apart.
fn dots(width: usize, height: usize) -> Raster<f32> {
    Raster::from_fn(width, height, |col, row| {
        let [dx, dy] = [col, row].map(|at| (at % 16) as f32 - 7.7);
        200.0 - 150.0 * (4.5 - dx.hypot(dy)).clamp(0.0, 1.0)
    })
}

fn circles(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("find_circles");
    group.sample_size(10);
    for [width, height] in [[176, 144], [640, 480]] {
        let image = dots(width, height);
        group.throughput(Throughput::Elements(image.len() as u64));
        group.bench_function(BenchmarkId::new("dots", format!("{width}x{height}")), |bencher| {
            bencher.iter(|| find_circles(black_box(&image), &CircleOptions::default()).unwrap());
        });
    }
    group.finish();
}

criterion_group!(benches, boards, circles);
criterion_main!(benches);
