//! Several frequencies: counts, combined range, and typed errors.

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

#[test]
fn range_and_sigma_are_honest() {
    let modulations = modulations(&[80e6, 60e6]);
    let mut rng = Pcg64::seed_from_u64(11);
    let (truth, sigma_rad, n) = (3.21, [0.05, 0.08], 10_000);
    let mut planes = Vec::new();
    for (m, sigma) in modulations.iter().zip(sigma_rad) {
        let noise = |rng: &mut Pcg64| -> f64 { StandardNormal.sample(rng) };
        planes.push(Raster::from_fn(n, 1, |_, _| phase(m, truth, sigma * noise(&mut rng))));
    }
    let sigmas = sigma_rad.map(|sigma| Raster::filled(n, 1, sigma as f32));
    let options = MultiFrequencyOptions::default();
    let found = unwrap_multi_frequency(&planes, &modulations, Some(&sigmas), None, &options).unwrap();
    let errors: Vec<f64> = found.range.as_slice().iter().map(|&r| f64::from(r) - truth).collect();
    let mean = errors.iter().sum::<f64>() / n as f64;
    let scatter = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n as f64 - 1.0)).sqrt();
    let sigma = f64::from(found.sigma.as_slice()[0]);
    // A standard deviation from 10,000 samples is good to 0.7 %; three of that.
    assert!((scatter / sigma - 1.0).abs() < 0.021, "{scatter} {sigma}");
    assert!(mean.abs() < 4.0 * sigma / 100.0, "{mean}");
    let counts: Vec<i32> = found.wraps.iter().map(|w| w.as_slice()[0]).collect();
    assert_eq!(counts, modulations.iter().map(|m| (truth / m.ambiguity_interval_m()) as i32).collect::<Vec<_>>());
    // Without sigmas the range has none either.
    let found = unwrap_multi_frequency(&planes, &modulations, None, None, &options).unwrap();
    assert!(found.sigma.as_slice()[0].is_nan() && found.range.as_slice()[0].is_finite());
}

#[test]
fn phases_that_no_range_explains_are_not_sure() {
    let modulations = modulations(&[120e6, 80e6, 16e6]);
    let sigma = vec![Raster::filled(1, 1, 0.02_f32); 3];
    // Two paths: the phases of 2 m and 3.1 m mixed half and half as complex numbers.
    let mixed = |m: &Modulation| {
        let (a, b) = (m.phase_from_range(2.0), m.phase_from_range(3.1));
        (a.sin() + b.sin()).atan2(a.cos() + b.cos()).rem_euclid(TAU) as f32
    };
    let phases: Vec<_> = modulations.iter().map(|m| Raster::filled(1, 1, mixed(m))).collect();
    let options = MultiFrequencyOptions::default();
    let found = unwrap_multi_frequency(&phases, &modulations, Some(&sigma), None, &options).unwrap();
    assert!(found.confidence.as_slice()[0] < 0.6, "{:?}", found.confidence);
}

#[test]
fn masks_and_missing_phases_are_respected() {
    let modulations = modulations(&[120e6, 80e6, 16e6]);
    let mut phases: Vec<_> = modulations.iter().map(|m| Raster::filled(3, 1, phase(m, 4.0, 0.0))).collect();
    phases[2][(1, 0)] = f32::NAN;
    phases[1][(2, 0)] = f32::NAN;
    phases[2][(2, 0)] = f32::NAN;
    let mask = Raster::from_fn(3, 1, |col, _| col != 0);
    let options = MultiFrequencyOptions::default();
    let found = unwrap_multi_frequency(&phases, &modulations, None, Some(&mask), &options).unwrap();
    assert!(found.range[(0, 0)].is_nan() && found.confidence[(0, 0)] == 0.0);
    // 120 and 80 MHz repeat every 3.75 m: without 16 MHz, 4 m and 0.25 m are equally good.
    assert!(found.confidence[(1, 0)] < 0.1);
    assert!(found.range[(2, 0)].is_nan());
}

#[test]
fn bad_input_gets_a_typed_answer() {
    let two = modulations(&[80e6, 60e6]);
    let plane = Raster::filled(2, 2, 1.0_f32);
    let planes = vec![plane.clone(); 2];
    let options = MultiFrequencyOptions::default();
    let unwrap = |phases: &[Raster<f32>], m: &[Modulation], options: &MultiFrequencyOptions| {
        unwrap_multi_frequency(phases, m, None, None, options).unwrap_err()
    };
    assert_eq!(unwrap(&planes[..1], &two[..1], &options), Error::TooFewFrequencies { found: 1 });
    assert_eq!(unwrap(&[], &[], &options), Error::TooFewFrequencies { found: 0 });
    assert!(matches!(unwrap(&planes[..1], &two, &options), Error::PlaneCount { expected: 2, found: 1, .. }));
    assert!(matches!(
        unwrap(&planes, &[two[0], two[0]], &options),
        Error::EqualFrequencies { first: 0, second: 1, .. }
    ));
    let incommensurable = modulations(&[80e6, 80e6 / std::f64::consts::SQRT_2]);
    assert!(matches!(unwrap(&planes, &incommensurable, &options), Error::SearchTooLarge { limit: 4096, .. }));
    let limited = MultiFrequencyOptions { maximum_range_m: Some(10.0), ..options };
    assert!(unwrap_multi_frequency(&planes, &incommensurable, None, None, &limited).is_ok());
    assert!(matches!(unwrap(&planes, &two, &limited), Error::BeyondCombinedInterval { .. }));
    let negative = MultiFrequencyOptions { maximum_range_m: Some(-1.0), ..options };
    assert!(matches!(unwrap(&planes, &two, &negative), Error::OutOfDomain { .. }));
    let uneven = vec![plane, Raster::filled(3, 2, 1.0)];
    assert!(matches!(unwrap(&uneven, &two, &options), Error::Raster(_)));
    let empty = vec![Raster::filled(0, 0, 1.0_f32); 2];
    assert!(matches!(unwrap(&empty, &two, &options), Error::Empty { .. }));
}

#[test]
fn combination_weighs_by_variance() {
    let plane = |values: &[f32]| Raster::from_vec(values.len(), 1, values.to_vec()).unwrap();
    let ranges = [plane(&[2.0, 2.0, f32::NAN, 2.0, f32::NAN]), plane(&[2.3, 2.3, 3.0, 4.0, f32::NAN])];
    let nan = f32::NAN;
    let sigmas = [plane(&[0.1, 0.1, 0.1, nan, 0.1]), plane(&[0.2, nan, 0.2, nan, 0.1])];
    let found = combine_frequencies(&ranges, &sigmas).unwrap();
    // (2.0 / 0.01 + 2.3 / 0.04) / 125 = 2.06; a range without sigma gives way; plain mean where none has one.
    let expected = [2.06, 2.0, 3.0, 3.0];
    for (found, expected) in found.range.as_slice().iter().zip(expected) {
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }
    assert!(found.range.as_slice()[4].is_nan());
    assert!((found.sigma.as_slice()[0] - 125.0_f32.powf(-0.5)).abs() < 1e-7);
    assert!(found.sigma.as_slice()[3].is_nan());
    // 0.3^2 / (0.01 + 0.04)
    assert!((found.chi_squared.as_slice()[0] - 1.8).abs() < 1e-5);
    assert!(found.chi_squared.as_slice()[2].is_nan());
    assert!(matches!(combine_frequencies(&[], &[]), Err(Error::TooFewFrequencies { .. })));
    assert!(matches!(combine_frequencies(&ranges, &sigmas[..1]), Err(Error::PlaneCount { .. })));
}

#[test]
fn intervals_combine_as_least_common_multiples() {
    let interval = |hz: &[f64]| {
        let modulations: Vec<_> = hz.iter().map(|&hz| Modulation::new(hz).unwrap()).collect();
        combined_interval_m(&modulations).unwrap()
    };
    let single = |hz: f64| Modulation::new(hz).unwrap().ambiguity_interval_m();
    for (hz, common) in [
        (vec![80e6, 60e6], 20e6),
        (vec![100e6, 80e6], 20e6),
        (vec![16e6, 80e6, 120e6], 8e6),
        (vec![80.32e6, 60.24e6], 20.08e6),
    ] {
        // Euclid's steps multiply rounding errors of 1e-16 by the quotients, which are below a hundred here.
        assert!((interval(&hz) / single(common) - 1.0).abs() < 1e-9, "{hz:?}");
    }
    // Without a common divisor above the tolerance the interval is at least 1e4 single ones.
    assert!(interval(&[80e6, 80e6 / std::f64::consts::SQRT_2]) > 1e4 * single(80e6));
}

#[test]
fn frequencies_too_far_apart_have_no_combined_interval() {
    let modulations = [1e3, 1e9].map(|hz| Modulation::new(hz).unwrap());
    let found = combined_interval_m(&modulations);
    assert!(matches!(found, Err(Error::OutOfDomain { value, .. }) if (value - 1e6).abs() < 1.0), "{found:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_range_inside_the_interval_comes_back(fraction in 0.0_f64..0.999, pair in 0_usize..3) {
        let hz = [vec![80e6, 60e6], vec![100e6, 80e6], vec![120e6, 80e6, 16e6]];
        let modulations = modulations(&hz[pair]);
        let range = fraction * combined_interval_m(&modulations).unwrap();
        let phases: Vec<_> = modulations.iter().map(|m| Raster::filled(1, 1, phase(m, range, 0.0))).collect();
        let options = MultiFrequencyOptions::default();
        let found = unwrap_multi_frequency(&phases, &modulations, None, None, &options).unwrap();
        // Phases are rounded to 2e-7 rad.
        prop_assert!((f64::from(found.range.as_slice()[0]) - range).abs() < 1e-5);
    }
}
