//! Shot and dark noise from twenty simulated frames.
//!
//! `cargo run --release -p sensor-noise --example noise_of_samples`
#![allow(clippy::print_stdout)]

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{Modulation, RawFrame, Samples};
use sensor_noise::{NoiseFitOptions, RepeatedSamples, SampleUnits, estimate_sample_noise};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut random = Pcg64::seed_from_u64(1);
    let mut frames = Vec::new();
    for _ in 0..20 {
        let sample = |index: usize| {
            let mean = 100.0 + 2000.0 * ((index * 7919) % 25_344) as f64 / 25_344.0;
            let noise: f64 = StandardNormal.sample(&mut random);
            (mean + noise * (0.8 * mean + 36.0).sqrt()) as f32
        };
        let samples = Samples::F32((0..4 * 176 * 144).map(sample).collect());
        frames.push(RawFrame::new(176, 144, 4, vec![Modulation::new(30e6)?], samples)?);
    }
    let station = RepeatedSamples { station: "A".into(), frames: &frames[..] };
    let found = estimate_sample_noise(&[station], &SampleUnits::default(), &NoiseFitOptions::default())?.noise;
    println!("shot {:.4} per unit (true: 0.8), dark {:.3} (true: 6)", found.shot_variance_per_unit, found.dark_sigma);
    Ok(())
}
