//! A frame through the processor, once its counts are carried.
#![allow(missing_docs, clippy::unwrap_used)]

#[path = "../tests/common/mod.rs"]
#[allow(dead_code)] // each user takes a part of it
mod common;

use common::{INTERVAL_S, Sequence};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use live_frames::{Limits, Processor};

fn process(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("process");
    group.sample_size(20);
    for (name, modulation_hz) in [("one frequency", vec![30e6]), ("two frequencies", vec![80e6, 60e6])] {
        let sequence = Sequence { width: 640, height: 480, modulation_hz, rays: 1, ..Sequence::default() };
        let raw: Vec<_> = (0..8).map(|number| sequence.frame(number).raw).collect();
        let mut processor =
            Processor::new(&sequence.camera(), &sequence.calibration(), common::stages(100_000), Limits::default())
                .unwrap();
        let mut number = 0_usize;
        group.throughput(Throughput::Elements((sequence.width * sequence.height) as u64));
        group.bench_function(BenchmarkId::new(name, "640x480"), |bencher| {
            bencher.iter(|| {
                // Forth and back, so that motion has no jump.
                let at = number % 14;
                let samples = raw[if at < 8 { at } else { 14 - at }].samples();
                number += 1;
                processor.process(samples, number as f64 * INTERVAL_S).unwrap().counts.failed
            });
        });
    }
    group.finish();
}

criterion_group!(benches, process);
criterion_main!(benches);
