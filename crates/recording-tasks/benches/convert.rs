//! A recording looked through, and made a survey.
#![allow(missing_docs, clippy::unwrap_used)]

use std::fs::File;

use commands::Silent;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use recording_tasks::{ConvertRequest, convert, inspect_recording};
use recordings::{CameraInfo, Encoding, Image, McapWriter, Payload};

const SIZE: [u32; 2] = [320, 240];
const FRAMES: i64 = 20;

fn recordings(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("wall.mcap");
    let mut writer = McapWriter::new(File::create(&file).unwrap()).unwrap();
    let (camera, depth) = (writer.stream("/depth/camera_info").unwrap(), writer.stream("/depth/image_raw").unwrap());
    let matrix = [300.0, 0.0, 159.5, 0.0, 300.0, 119.5, 0.0, 0.0, 1.0];
    let info = CameraInfo { width: SIZE[0], height: SIZE[1], matrix, ..CameraInfo::default() };
    writer.message(camera, 0, &Payload::CameraInfo(Box::new(info))).unwrap();
    for frame in 0..FRAMES {
        let values = vec![1500 + frame as u16; (SIZE[0] * SIZE[1]) as usize];
        let image = Image::from_u16("depth", SIZE, Encoding::Unsigned16, &values).unwrap();
        writer.message(depth, 33_000_000 * frame, &Payload::Image(image)).unwrap();
    }
    writer.finish().unwrap();
    let mut group = criterion.benchmark_group("recording");
    group.sample_size(10);
    group.throughput(Throughput::Elements(FRAMES as u64));
    group.bench_function("inspect", |bencher| bencher.iter(|| inspect_recording(&file, &Silent).unwrap()));
    let request = ConvertRequest::new(&file, folder.path().join("survey"));
    group.bench_function("to_survey", |bencher| bencher.iter(|| convert(&request, &Silent).unwrap()));
    group.finish();
}

criterion_group!(benches, recordings);
criterion_main!(benches);
