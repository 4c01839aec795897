//! Frames in and out of `.npz`, a million points in and out of PLY.
#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;
use std::path::Path;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use range_image::{RawFrame, Samples};
use range_io::ply::{CloudFile, Precision, read_cloud, write_cloud};
use range_io::survey::{InputFrame, Survey, read_frame, write_frame};

const SIZES: [(usize, usize); 3] = [(176, 144), (640, 480), (1024, 1024)];

fn survey(width: usize, height: usize) -> Survey {
    let text = format!(
        "(camera: (width: {width}, height: {height}, pixel_pitch_mm: (0.04, 0.04), principal_distance_mm: 8.0,
        principal_point_mm: (0, 0), modulation_hz: [20e6], phase_steps: 4), level: samples,
        frames: [(file: \"frame.npz\", station: \"S0\")])"
    );
    Survey::parse(Path::new("survey.ron"), &text).unwrap()
}

/// Counts that compress about as badly as measured ones: a slope with pseudo-random low bits.
fn frame(survey: &Survey) -> InputFrame {
    let camera = &survey.camera;
    let count = 4 * camera.width * camera.height;
    let noise = |index: usize| (index as u32).wrapping_mul(2_654_435_761) >> 25;
    let samples = (0..count).map(|index| (index / 97 % 3000) as u16 + noise(index) as u16).collect();
    let modulations = camera.modulations().unwrap();
    InputFrame::Samples(RawFrame::new(camera.width, camera.height, 4, modulations, Samples::U16(samples)).unwrap())
}

fn frames(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("frame.npz");
    for (width, height) in SIZES {
        let survey = survey(width, height);
        let frame = frame(&survey);
        let size = BenchmarkId::from_parameter(format!("{width}x{height}"));
        let mut group = criterion.benchmark_group("write_frame");
        group.throughput(Throughput::Elements((width * height) as u64));
        group.bench_function(size.clone(), |bencher| bencher.iter(|| write_frame(&file, black_box(&frame)).unwrap()));
        group.finish();
        let mut group = criterion.benchmark_group("read_frame");
        group.throughput(Throughput::Elements((width * height) as u64));
        group
            .bench_function(size, |bencher| bencher.iter(|| read_frame(black_box(&survey), folder.path(), 0).unwrap()));
        group.finish();
    }
}

fn clouds(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("cloud.ply");
    let count = 1_000_000;
    let cloud = CloudFile {
        points: (0..count).map(|index| [f64::from(index) * 1e-3, 1.0, -2.0]).collect(),
        intensity: Some(vec![100.0; count as usize]),
        sigma: Some(vec![0.005; count as usize]),
        flags: Some(vec![0; count as usize]),
        frame: Some((0..count as u32).collect()),
        ..CloudFile::default()
    };
    let mut group = criterion.benchmark_group("write_cloud");
    group.sample_size(10).throughput(Throughput::Elements(count as u64));
    group.bench_function("PLY", |bencher| bencher.iter(|| write_cloud(&file, black_box(&cloud), Precision::Single)));
    group.finish();
    let mut group = criterion.benchmark_group("read_cloud");
    group.sample_size(10).throughput(Throughput::Elements(count as u64));
    group.bench_function("PLY", |bencher| bencher.iter(|| read_cloud(black_box(&file)).unwrap()));
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().measurement_time(Duration::from_secs(3)).warm_up_time(Duration::from_millis(500));
    targets = frames, clouds
}
criterion_main!(benches);
