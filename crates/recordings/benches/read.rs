//! A recording of depth images, read from memory, and one that is written.
#![allow(missing_docs, clippy::unwrap_used)]

use std::io::Cursor;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use recordings::{Encoding, Image, McapWriter, Payload, Recording};

/// Images of a wall with some noise: 640 x 480.
const SIZE: [u32; 2] = [640, 480];
const FRAMES: i64 = 20;

fn payload() -> Payload {
    let noise = |index: u32| (index.wrapping_mul(2_654_435_761) >> 29) as u16;
    let values: Vec<u16> = (0..SIZE[0] * SIZE[1]).map(|index| 1500 + noise(index)).collect();
    Payload::Image(Image::from_u16("depth", SIZE, Encoding::Unsigned16, &values).unwrap())
}

fn written(payload: &Payload) -> Vec<u8> {
    let mut writer = McapWriter::new(Vec::new()).unwrap();
    let stream = writer.stream("/depth/image_raw").unwrap();
    for frame in 0..FRAMES {
        writer.message(stream, frame, payload).unwrap();
    }
    writer.finish().unwrap()
}

fn mcap(criterion: &mut Criterion) {
    let payload = payload();
    let bytes = written(&payload);
    let mut group = criterion.benchmark_group("mcap");
    group.sample_size(10);
    group.throughput(Throughput::Bytes(2 * u64::from(SIZE[0] * SIZE[1]) * FRAMES as u64));
    group.bench_function("read", |bencher| {
        bencher.iter(|| {
            let mut recording = Recording::from_reader("memory", Cursor::new(bytes.clone())).unwrap();
            let mut count = 0;
            while recording.next_message().unwrap().is_some() {
                count += 1;
            }
            assert_eq!(count, FRAMES);
        });
    });
    group.bench_function("write", |bencher| bencher.iter(|| written(&payload)));
    group.finish();
}

criterion_group!(benches, mcap);
criterion_main!(benches);
