//! Demodulation of four phase steps, and phase and amplitude of the complex image.
#![allow(clippy::unwrap_used, missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use range_image::{ComplexFrame, DemodulationOptions, Demodulator, Modulation, NoiseModel, RawFrame, Samples, average};

const SIZES: [(usize, usize); 3] = [(176, 144), (640, 480), (1024, 1024)];

fn raw(width: usize, height: usize, samples: impl Fn(Vec<u16>) -> Samples) -> RawFrame {
    let values = (0..4 * width * height).map(|i| (i * 7919 % 4001) as u16).collect();
    RawFrame::new(width, height, 4, vec![Modulation::new(20e6).unwrap()], samples(values)).unwrap()
}

fn demodulator() -> Demodulator {
    Demodulator::new(&DemodulationOptions {
        saturation: Some(4095.0),
        low_amplitude: Some(10.0),
        noise: NoiseModel { shot_variance_per_unit: 0.5, dark_sigma: 3.0 },
        ..DemodulationOptions::default()
    })
    .unwrap()
}

fn demodulation(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("Demodulate");
    for (width, height) in SIZES {
        group.throughput(Throughput::Elements((width * height) as u64));
        let frames = [
            ("u16", raw(width, height, Samples::U16)),
            ("f32", raw(width, height, |v| Samples::F32(v.into_iter().map(f32::from).collect()))),
        ];
        for (name, frame) in &frames {
            let demodulator = demodulator();
            let mut out = ComplexFrame::empty();
            group.bench_function(format!("{name}/{width}x{height}"), |bencher| {
                bencher.iter(|| demodulator.demodulate_into(black_box(frame), &mut out).unwrap());
            });
        }
    }
}

fn derived_planes(criterion: &mut Criterion) {
    for (width, height) in SIZES {
        let mut group = criterion.benchmark_group("ComplexChannel");
        group.throughput(Throughput::Elements((width * height) as u64));
        let mut frame = ComplexFrame::empty();
        demodulator().demodulate_into(&raw(width, height, Samples::U16), &mut frame).unwrap();
        let channel = &frame.channels[0];
        let mut plane = channel.sigma.clone();
        group.bench_function(format!("phase/{width}x{height}"), |bencher| {
            bencher.iter(|| black_box(channel).phase_into(&mut plane).unwrap());
        });
        group.bench_function(format!("amplitude/{width}x{height}"), |bencher| {
            bencher.iter(|| black_box(channel).amplitude_into(&mut plane).unwrap());
        });
        group.finish();
        let frames = vec![frame.clone(); 4];
        let mut group = criterion.benchmark_group("Average");
        group.throughput(Throughput::Elements((width * height) as u64));
        group.bench_function(format!("4 frames of {width}x{height}"), |bencher| {
            bencher.iter(|| average(black_box(&frames)).unwrap());
        });
        group.finish();
    }
}

criterion_group!(benches, demodulation, derived_planes);
criterion_main!(benches);
