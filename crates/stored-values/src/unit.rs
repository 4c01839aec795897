//! The unit of the values, as far as distances and noise of range cameras tell it.

use range_image::Raster;
use statistics::{quantile, robust_standard_deviation};

/// Median distance of what range cameras see, metre, and how far it varies (natural logarithm): 0.3 to 12 m in nineteen
/// of twenty frames.
const DISTANCE_M: f64 = 2.0;
const DISTANCE_VARIES: f64 = 0.9;
/// Their noise from pixel to pixel, metre: 0.2 to 80 mm, as frames may be averaged, filtered or dark.
const NOISE_M: f64 = 0.004;
const NOISE_VARIES: f64 = 1.5;
/// Probability that values go beyond the ambiguity interval of the only frequency: some are unwrapped.
const BEYOND: f64 = 0.05;
/// Part of the values that may be higher than the highest: codes and wild ones.
const WILD: f64 = 1e-3;
/// Second differences have six times the variance of a value.
const OF_SECOND_DIFFERENCES: f64 = 6.0;
/// Noise below this share of the distance is what single precision leaves of whole numbers that were ranges for a while: 30 of
/// its roundings. No range camera is as quiet as 4 µm at 2 m.
const ROUNDING: f64 = 30.0 * (f32::EPSILON / 2.0) as f64;

/// What is known of the values, in their own unit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct UnitWitness {
    /// Their median.
    pub median: f64,
    /// The highest, but for one in a thousand.
    pub highest: f64,
    /// Standard deviation from pixel to pixel; `None` where it is not known, or hidden by rounding.
    pub noise: Option<f64>,
}

impl UnitWitness {
    /// Of a frame; what is not finite or not positive is left out. `None` without values.
    pub fn of(values: &Raster<f32>) -> Option<Self> {
        let is_value = |value: &f32| value.is_finite() && *value > 0.0;
        let mut all: Vec<f64> =
            values.as_slice().iter().filter(|value| is_value(value)).map(|v| f64::from(*v)).collect();
        if all.is_empty() {
            return None;
        }
        let of_three = |three: &[f32]| match three {
            [a, b, c] if three.iter().all(is_value) => Some(f64::from(*a) - 2.0 * f64::from(*b) + f64::from(*c)),
            _ => None,
        };
        let second: Vec<f64> = values.rows().flat_map(|row| row.windows(3)).filter_map(of_three).collect();
        let noise = robust_standard_deviation(&second) / OF_SECOND_DIFFERENCES.sqrt();
        let (median, highest) = (quantile(&mut all, 0.5), quantile(&mut all, 1.0 - WILD));
        let is_known = noise > ROUNDING * median;
        Some(Self { median, highest, noise: is_known.then_some(noise) })
    }
}

/// Probabilities of units (metre each, as 0.001), all as probable before, from distance, noise and the ambiguity interval (metre,
/// of a camera with one frequency). NaN without values.
///
/// This is weak evidence: a scene twice as large as others is no wonder. Units a factor of a thousand apart are told, those
/// a factor of ten apart seldom.
pub fn judge_unit(witness: &UnitWitness, ambiguity_interval_m: Option<f64>, units_m: &[f64]) -> Vec<f64> {
    let log_normal = |value: f64, middle: f64, varies: f64| -0.5 * ((value / middle).ln() / varies).powi(2);
    let log = |unit_m: &f64| {
        let distance = log_normal(witness.median * unit_m, DISTANCE_M, DISTANCE_VARIES);
        let noise = witness.noise.map_or(0.0, |noise| log_normal(noise * unit_m, NOISE_M, NOISE_VARIES));
        let beyond = ambiguity_interval_m.map_or(0.0, |interval| {
            if witness.highest * unit_m > interval { BEYOND.ln() } else { (1.0 - BEYOND).ln() }
        });
        distance + noise + beyond
    };
    let logs: Vec<f64> = units_m.iter().map(log).collect();
    let highest = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let all: f64 = logs.iter().map(|log| (log - highest).exp()).sum();
    logs.iter().map(|log| (log - highest).exp() / all).collect()
}
