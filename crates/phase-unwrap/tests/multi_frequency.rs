//! Several frequencies: counts, combined range, and typed errors.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::f64::consts::TAU;

use phase_unwrap::{Error, MultiFrequencyOptions, combine_frequencies, combined_interval_m, unwrap_multi_frequency};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{Modulation, Raster};

fn modulations(hz: &[f64]) -> Vec<Modulation> {
    hz.iter().map(|&hz| Modulation::new(hz).unwrap()).collect()
}

fn phase(modulation: &Modulation, range_m: f64, error_rad: f64) -> f32 {
    let phase = (modulation.phase_from_range(range_m) + error_rad).rem_euclid(TAU) as f32;
    phase.min(std::f32::consts::TAU)
}

/// Share of right counts among all and among the sure, and the share of sure pixels.
fn simulate(hz: &[f64], sigma_rad: f64, seed: u64) -> [f64; 3] {
    let modulations = modulations(hz);
    let limit = combined_interval_m(&modulations).unwrap();
    let mut rng = Pcg64::seed_from_u64(seed);
    let truth: Vec<f64> = (0..20_000).map(|_| limit * (0.05 + 0.9 * rng.random::<f64>())).collect();
    let phases: Vec<Raster<f32>> = modulations
        .iter()
        .map(|m| {
            let noise = |rng: &mut Pcg64| -> f64 { StandardNormal.sample(rng) };
            let data = truth.iter().map(|&r| phase(m, r, sigma_rad * noise(&mut rng))).collect();
            Raster::from_vec(200, 100, data).unwrap()
        })
        .collect();
    let sigma = vec![Raster::filled(200, 100, sigma_rad as f32); hz.len()];
    let options = MultiFrequencyOptions::default();
    let found = unwrap_multi_frequency(&phases, &modulations, Some(&sigma), None, &options).unwrap();
    let (mut right, mut sure, mut sure_right) = (0.0, 0.0, 0.0);
    for (index, &range) in truth.iter().enumerate() {
        // A wrong count moves the combined range by a good part of the shortest interval; noise does not.
        let ok =
            (f64::from(found.range.as_slice()[index]) - range).abs() < 0.25 * modulations[0].ambiguity_interval_m();
        let is_sure = found.confidence.as_slice()[index] >= 0.6;
        right += f64::from(u8::from(ok));
        sure += f64::from(u8::from(is_sure));
        sure_right += f64::from(u8::from(ok && is_sure));
    }
    [right / 20_000.0, sure_right / sure, sure / 20_000.0]
}

#[test]
fn counts_are_right_under_noise() {
    for (hz, sigma, bar, sure_bar) in [
        (vec![80e6, 60e6], 0.1, 0.999, 0.999),
        // Counts stay apart by pi / sqrt(n1^2 + n2^2) in the phase difference: 0.63 rad here, 2.1 sigma at 0.3.
        (vec![80e6, 60e6], 0.3, 0.95, 0.98),
        (vec![100e6, 80e6], 0.2, 0.98, 0.99),
        (vec![120e6, 80e6, 16e6], 0.2, 0.98, 0.99),
    ] {
        let [right, sure_right, sure] = simulate(&hz, sigma, 5);
        println!("{hz:?} sigma {sigma}: right {right:.4}, of the sure {sure_right:.4}, sure {sure:.4}");
        assert!(right >= bar && sure_right >= sure_bar && sure > 0.8, "{hz:?} {sigma}: {right} {sure_right} {sure}");
    }
}
