//! Synthetic range differences whose truth is known.
#![allow(dead_code)]

pub mod dense;
pub mod unknown_walls;

use error_models::{AmplitudeHyperbola, RangeErrorModel, RangeTerms};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use range_calibration::RangeDifference;

/// Ambiguity interval at 30 MHz, metre.
pub const INTERVAL: f64 = 4.996_540_966_666_667;

pub fn terms() -> RangeTerms {
    RangeTerms { d0: 0.024, periodic: [0.006, -0.004, 0.003, 0.005, -0.009, 0.004], e1: 2e-3, e2: -1e-3 }
}

pub fn model(hyperbola: Option<AmplitudeHyperbola>) -> RangeErrorModel {
    RangeErrorModel { terms: terms(), hyperbola, ..RangeErrorModel::error_free(INTERVAL) }
}

/// What a camera with a field of view of 45 degrees shows of a wall straight in front of it at these distances, on
/// a grid of 16 x 12 pixels. Patches of the wall are dark: amplitudes spread over a factor of 20 at each distance.
pub fn walls(model: &RangeErrorModel, distances_m: &[f64], sigma_m: f64, seed: u64) -> Vec<RangeDifference> {
    let mut random = Pcg64::seed_from_u64(seed);
    let noise = Normal::new(0.0, sigma_m).unwrap();
    let mut differences = Vec::new();
    for distance in distances_m {
        for index in 0..16 * 12 {
            let x_mm = (f64::from(index % 16) - 7.5) * 0.44;
            let y_mm = (f64::from(index / 16) - 5.5) * 0.48;
            let reference_range_m = distance * (x_mm * x_mm + y_mm * y_mm + 64.0_f64).sqrt() / 8.0;
            let albedo = 0.05 * 20.0_f64.powf(random.random::<f64>());
            let amplitude = 4000.0 * albedo / (reference_range_m * reference_range_m);
            let shown = model.observed_range(reference_range_m, x_mm, y_mm, amplitude).unwrap();
            let observed_range_m = shown + noise.sample(&mut random);
            differences.push(RangeDifference { observed_range_m, reference_range_m, x_mm, y_mm, amplitude, sigma_m });
        }
    }
    differences
}

/// Distances that cover one ambiguity interval.
pub fn track() -> Vec<f64> {
    (0..20).map(|step| 0.6 + 0.25 * f64::from(step)).collect()
}
