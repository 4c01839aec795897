//! Noise of samples from repeated frames.
#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{Modulation, RawFrame, Samples};
use sensor_noise::{NoiseFitOptions, RepeatedSamples, SampleUnits, estimate_sample_noise};

const SAMPLES: usize = 4 * 176 * 144;

fn noise(criterion: &mut Criterion) {
    let mut random = Pcg64::seed_from_u64(1);
    let mut frame = |_| {
        let sample = |index: usize| {
            let mean = 100.0 + 2000.0 * ((index * 7919) % 25_344) as f64 / 25_344.0;
            let noise: f64 = StandardNormal.sample(&mut random);
            (mean + noise * (0.8 * mean + 36.0).sqrt()) as f32
        };
        let samples = Samples::F32((0..SAMPLES).map(sample).collect());
        RawFrame::new(176, 144, 4, vec![Modulation::new(30e6).unwrap()], samples).unwrap()
    };
    let frames: Vec<RawFrame> = (0..20).map(&mut frame).collect();
    let station = RepeatedSamples { station: "A".into(), frames: &frames[..] };
    let mut group = criterion.benchmark_group("estimate_sample_noise");
    group.sample_size(10).throughput(Throughput::Elements((frames.len() * SAMPLES) as u64));
    group.bench_function("20 frames of 176x144", |bencher| {
        let (units, options) = (SampleUnits::default(), NoiseFitOptions::default());
        bencher.iter(|| estimate_sample_noise(std::slice::from_ref(&station), &units, &options).unwrap());
    });
    group.finish();
}

criterion_group!(benches, noise);
criterion_main!(benches);
