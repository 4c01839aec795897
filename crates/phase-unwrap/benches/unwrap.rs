//! Times of the spatial tree, the absolute counts and two frequencies at three frame sizes.
#![allow(clippy::unwrap_used, missing_docs)]

use std::f64::consts::TAU;
use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use phase_unwrap::{
    ExactOptions, ExactUnwrapped, KernelDensityOptions, KnownWraps, LeastCuts, MultiFrequencyOptions, MultiUnwrapped,
    MultiUnwrapper, NoisyOptions, NoisyUnwrapped, NoisyUnwrapper, PhaseNoise, SpatialOptions, Unwrapped, Unwrapper,
};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{Modulation, Raster};

const SIZES: [(usize, usize); 3] = [(176, 144), (640, 480), (1024, 1024)];

/// Range in metres: a tilted floor before a wall, and boxes that stand off.
fn range(width: usize, height: usize) -> Raster<f64> {
    Raster::from_fn(width, height, |col, row| {
        let (x, y) = (col as f64 / width as f64, row as f64 / height as f64);
        let background = (7.0 + x).min(2.0 / (y - 0.45).max(0.01));
        let near = (x - 0.3).abs() < 0.1 && (y - 0.5).abs() < 0.15;
        if near { 1.2 + 0.3 * x } else { background }
    })
}

fn wrapped(range: &Raster<f64>, modulation: &Modulation, seed: u64) -> (Raster<f32>, Raster<f32>) {
    let mut rng = Pcg64::seed_from_u64(seed);
    let amplitude = range.map(|r| (2000.0 / (r * r)) as f32);
    let phase = range.map(|r| {
        let noise: f64 = StandardNormal.sample(&mut rng);
        let sigma = 0.02 * (r / 5.0).powi(2);
        ((modulation.phase_from_range(*r) + sigma * noise).rem_euclid(TAU) as f32).min(std::f32::consts::TAU)
    });
    (phase, amplitude)
}

fn spatial(c: &mut Criterion) {
    let modulation = Modulation::new(30e6).unwrap();
    let mut group = c.benchmark_group("Unwrap");
    for (width, height) in SIZES {
        group.throughput(Throughput::Elements((width * height) as u64));
        let (phase, amplitude) = wrapped(&range(width, height), &modulation, 1);
        let size = format!("{width}x{height}");
        let mut out = Unwrapped::default();
        let mut unwrapper = Unwrapper::new(SpatialOptions::default()).unwrap();
        group.bench_function(format!("tree/{size}"), |b| {
            b.iter(|| unwrapper.unwrap_into(black_box(&phase), None, None, KnownWraps::Nothing, &mut out).unwrap());
        });
        group.bench_function(format!("absolute/{size}"), |b| {
            b.iter(|| {
                let amplitude = Some(&amplitude);
                unwrapper.unwrap_into(black_box(&phase), amplitude, None, KnownWraps::Nothing, &mut out).unwrap();
            });
        });
    }
}

fn multi_frequency(c: &mut Criterion) {
    let sets: [(&str, &[f64]); 2] = [("two", &[80e6, 60e6]), ("three", &[80e6, 16e6, 120e6])];
    let mut group = c.benchmark_group("Unwrap");
    for ((number, hz), (width, height)) in sets.iter().flat_map(|set| SIZES.map(|size| (*set, size))) {
        group.throughput(Throughput::Elements((width * height) as u64));
        let modulations: Vec<_> = hz.iter().map(|&hz| Modulation::new(hz).unwrap()).collect();
        let range = range(width, height);
        let phases: Vec<_> = modulations.iter().map(|m| wrapped(&range, m, 2).0).collect();
        for (how, kernel) in [("alone", None), ("neighbours", Some(KernelDensityOptions::default()))] {
            let options = MultiFrequencyOptions { kernel, ..MultiFrequencyOptions::default() };
            let mut unwrapper = MultiUnwrapper::new(&modulations, options).unwrap();
            let mut out = MultiUnwrapped::default();
            group.bench_function(format!("{number}_frequencies_{how}/{width}x{height}"), |b| {
                b.iter(|| unwrapper.unwrap_into(black_box(&phases), None, None, &mut out).unwrap());
            });
        }
    }
}

/// One radian of noise on the same scene: filter, tree and cuts.
fn noisy(c: &mut Criterion) {
    let modulation = Modulation::new(30e6).unwrap();
    let mut group = c.benchmark_group("Unwrap");
    for (width, height) in SIZES {
        group.throughput(Throughput::Elements((width * height) as u64));
        let mut rng = Pcg64::seed_from_u64(3);
        let phase = range(width, height).map(|r| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            ((modulation.phase_from_range(*r) + noise).rem_euclid(TAU) as f32).min(std::f32::consts::TAU)
        });
        let size = format!("{width}x{height}");
        let mut out = NoisyUnwrapped::default();
        let mut unwrapper = NoisyUnwrapper::new(NoisyOptions::default()).unwrap();
        group.bench_function(format!("noisy/{size}"), |b| {
            b.iter(|| unwrapper.unwrap_into(black_box(&phase), PhaseNoise::Uniform(1.0), None, &mut out).unwrap());
        });
        let mut out = ExactUnwrapped::default();
        let mut cuts = LeastCuts::new(ExactOptions::default());
        group.bench_function(format!("cuts/{size}"), |b| {
            b.iter(|| cuts.unwrap_into(black_box(&phase), None, None, &mut out).unwrap());
        });
    }
}

criterion_group!(benches, spatial, multi_frequency, noisy);
criterion_main!(benches);
