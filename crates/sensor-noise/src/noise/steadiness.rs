//! Whether the frames of a station show one scene by one camera at rest.

use std::f64::consts::PI;

use error_models::{NamedParameter, ParameterStatus};
use rayon::prelude::*;
use statistics::{bonferroni, chi_squared_limit};

use super::NoiseFitOptions;
use super::bins::{has_moved, moved_limit};
use super::repeats::Repeats;
use crate::{Error, Result};

/// What the frames of a station say of drift and of unlike frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Steadiness {
    /// Name of the station.
    pub station: String,
    /// Number of frames.
    pub frames: usize,
    /// Variance from successive differences over variance about the mean, averaged over the values: 1 without drift,
    /// whatever the distribution of the noise; smaller where values wander from frame to frame (`[vonNeumann1941]`).
    /// NaN for two frames, which cannot tell.
    pub ratio: f64,
    /// Standard deviation of the ratio where there is no drift.
    pub ratio_sigma: f64,
    /// Whether the ratio is significantly (four of its deviations) and noticeably (1 %) below 1.
    pub drifts: bool,
    /// Scatter of each frame about the station's mean over the noise that was estimated, both as variances.
    pub frame_factors: Vec<f64>,
    /// Values that each of these comes from.
    pub frame_values: usize,
}

/// Probability that of all frames of a capture one is refused as unlike the others though it shows the same scene.
const UNLIKE_BY_CHANCE: f64 = 1e-3;
/// A ratio that is less below 1 than this changes no noise worth mentioning, however significant.
const NOTICEABLE: f64 = 0.01;

impl Steadiness {
    pub(super) fn new(station: &str, frames: usize, repeats: &[Repeats]) -> Self {
        let (mut sum, mut variance, mut count) = (0.0, 0.0, 0.0);
        for one in repeats.iter().filter(|one| one.count > 2 && one.variance > 0.0) {
            let n = one.count as f64;
            sum += one.successive / one.variance;
            variance += (n - 2.0) / ((n - 1.0) * (n + 1.0));
            count += 1.0;
        }
        let (ratio, ratio_sigma) = (sum / count, variance.sqrt() / count);
        let drifts = 1.0 - ratio > (4.0 * ratio_sigma).max(NOTICEABLE);
        Self {
            station: station.to_owned(),
            frames,
            ratio,
            ratio_sigma,
            drifts,
            frame_factors: Vec::new(),
            frame_values: 0,
        }
    }

    /// Refuses a drift so fast that successive differences hold too much of it.
    ///
    /// A straight drift that adds the share T to the variance adds `6 T / n (n + 1)` to that of successive differences.
    pub(super) fn require_slow(&self, options: &NoiseFitOptions) -> Result<()> {
        if !self.drifts {
            return Ok(());
        }
        let n = self.frames as f64;
        let left = 6.0 / (n * (n + 1.0));
        let drift = if self.ratio > left { (1.0 - self.ratio) / (self.ratio - left) } else { f64::INFINITY };
        if drift * left <= options.largest_drift_share {
            return Ok(());
        }
        Err(Error::FramesDrift { station: self.station.clone(), ratio: self.ratio, share: drift * left })
    }

    /// Refuses a frame that scatters more than the others: by more than is allowed, and than chance lets the few values that are taken of a
    /// frame of a long capture of so many `frames`.
    pub(super) fn require_alike(&self, options: &NoiseFitOptions, frames: usize) -> Result<()> {
        // Two frames lie equally far from their mean, and a drift sends the first and the last one off.
        if self.frames < 3 || self.drifts {
            return Ok(());
        }
        let mut sorted = self.frame_factors.clone();
        sorted.sort_by(f64::total_cmp);
        let usual = sorted[(sorted.len() - 1) / 2];
        let worst = self.frame_factors.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
        let largest = options.largest_frame_factor.max(self.largest_by_chance(frames));
        match worst {
            Some((frame, factor)) if factor / usual > largest => {
                Err(Error::FrameStandsOut { station: self.station.clone(), frame, factor: factor / usual })
            }
            _ => Ok(()),
        }
    }

    /// The ratio of a frame's scatter to the usual one that noise exceeds in one of so many frames with [`UNLIKE_BY_CHANCE`].
    fn largest_by_chance(&self, frames: usize) -> f64 {
        // The median of normal values has pi/2 of the variance of their mean.
        let values = self.frame_values as f64 / (1.0 + 0.5 * PI / self.frames as f64);
        chi_squared_limit(values, bonferroni(UNLIKE_BY_CHANCE, frames)) / values
    }
}

/// Values whose sums one task adds up; the sums are added in the order of the values.
pub(super) const VALUES_PER_TASK: usize = 8192;

/// The values of a station that did not move, by which its frames are held against each other.
pub(super) struct Alike {
    /// Position of the value, its mean over the frames, and the variance that noise gives it.
    still: Vec<(usize, f64, f64)>,
    /// Squares that noise alone sums up to.
    expected: f64,
}

impl Alike {
    /// Of each value its mean and its variance over so many frames, with the variance that noise gives it.
    pub(super) fn new(frames: usize, values: impl Iterator<Item = Option<[f64; 3]>>) -> Self {
        let limit = moved_limit(frames as f64 - 1.0);
        let is_still = |(place, value): (usize, Option<[f64; 3]>)| {
            let [mean, variance, expected] = value?;
            (!has_moved(variance, expected, limit) && expected > 0.0).then_some((place, mean, expected))
        };
        let still: Vec<(usize, f64, f64)> = values.enumerate().filter_map(is_still).collect();
        let expected = still.len() as f64 * (1.0 - 1.0 / frames as f64);
        Self { still, expected }
    }

    /// How many they are.
    pub(super) fn values(&self) -> usize {
        self.still.len()
    }

    /// Mean square deviation of a frame from the mean of all, over its expectation. `value` gives that at a position.
    pub(super) fn factor(&self, value: impl Fn(usize) -> f64 + Sync) -> f64 {
        let square = |(place, mean, expected): &(usize, f64, f64)| (value(*place) - mean).powi(2) / expected;
        let parts = self.still.par_chunks(VALUES_PER_TASK).map(|part| part.iter().map(square).sum());
        let parts: Vec<f64> = parts.collect();
        parts.iter().sum::<f64>() / self.expected
    }
}

/// An estimated or held parameter of the noise.
pub(super) fn parameter(name: &str, value: f64, sigma: f64, unit: &str, held: bool) -> NamedParameter {
    let status = if held { ParameterStatus::Held } else { ParameterStatus::Estimated };
    let sigma = if held { 0.0 } else { sigma };
    NamedParameter { name: name.to_owned(), value, sigma, unit: unit.to_owned(), status }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_frame_stands_out_only_beyond_chance() {
        let of_values = |frame_values: usize| Steadiness {
            frame_factors: vec![0.9, 1.0, 1.3, 0.95, 1.1],
            frame_values,
            ..Steadiness::new("A", 5, &[])
        };
        let options = NoiseFitOptions::default();
        // Of 40 values the variance has a standard deviation of 0.22.
        of_values(40).require_alike(&options, 5).unwrap();
        let refused = of_values(40_000).require_alike(&options, 5);
        assert!(matches!(refused, Err(Error::FrameStandsOut { frame: 2, .. })), "{refused:?}");
        let found = of_values(400);
        let [few, many] = [5, 100_000].map(|frames| found.largest_by_chance(frames));
        // 304 values count: quantiles of their variance at 2e-4 and 1e-8, by Cornish and Fisher z d + (z^2 - 1) d^2 / 3 with d = 0.0811.
        let expected = [3.54_f64, 5.61].map(|z| 1.0 + z * 0.0811 + (z * z - 1.0) * 0.0811_f64.powi(2) / 3.0);
        assert!((few - expected[0]).abs() < 0.01 && (many - expected[1]).abs() < 0.01, "{few} {many} {expected:?}");
    }
}
