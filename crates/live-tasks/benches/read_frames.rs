//! Frames out of a stream of bytes, and clouds into one.

#![allow(missing_docs, clippy::unwrap_used)]

use std::io::Cursor;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use live_tasks::{FrameHeader, FrameStream, SampleType, write_live_frame};

fn read(criterion: &mut Criterion) {
    let header = FrameHeader {
        sample_type: SampleType::U16,
        width: 640,
        height: 480,
        frequencies: 1,
        phase_steps: 4,
        timestamp_s: 0.0,
        integration_time_s: None,
        temperature_c: None,
    };
    let samples: Vec<u16> = (0..header.samples()).map(|k| (k % 4096) as u16).collect();
    let mut bytes = Vec::new();
    write_live_frame(&mut bytes, &header, samples.as_slice()).unwrap();
    let mut group = criterion.benchmark_group("wire");
    group.throughput(Throughput::Bytes(bytes.len() as u64));
    let mut used = None;
    group.bench_function("read_640x480", |bencher| {
        bencher.iter(|| used = FrameStream::new(Cursor::new(&bytes)).next_frame(used.take()).unwrap());
    });
    group.finish();
}

criterion_group!(benches, read);
criterion_main!(benches);
