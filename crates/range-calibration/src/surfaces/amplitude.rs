//! The amplitude hyperbola of Eq. 15 by numbers that surfaces tell almost linearly.
//!
//! With its value `Z` in the dark, its level `L` in bright light and the amplitude `k` of the knee between them,
//! `h3 = 1/Z²`, `h2 = 1/(Z k)`, `h1 = -L h2`, and for `x = a/k`, `l = L/Z` Eq. 15 reads `Δρ = Z (√(x² + 2 l x + 1) - x)`, which is
//! real at all amplitudes where `|l| <= 1`. The coefficients themselves leave the reals on the way.
//!
//! Surfaces hardly tell the level from `d0`: both together shift what is in bright light, and what the value in the dark is above the
//! level takes the difference. What is left of the level is how sharply the curve bends, by which ranges differ by some part of a
//! millimetre. So `D = Z - L` is estimated, and beside a `d0` that is estimated with what the level changes taken off it, which is put back
//! in the end. A level held at zero where it is -4 mm leaves `d0` 0.3, `h3` 0.8 of their standard deviations off.

use error_models::AmplitudeHyperbola;
use nalgebra::Matrix3;

use super::pixels::StationPixels;

/// Names of the numbers that are estimated.
pub(super) const NAMES: [&str; 3] =
    ["amplitude: value in the dark over that in bright light", "amplitude: knee", "amplitude: level in bright light"];
/// Position of the level among them.
const LEVEL: usize = 2;
/// The range term that the level takes the place of.
pub(super) const OFFSET: &str = "d0";
/// Standard deviation of the value in the dark beforehand, metre, and of the knee's logarithm: cameras err by less than a
/// decimetre, and their knees lie within a factor of twenty of the middle amplitude. Half or twice as much moves estimates by less
/// than their deviations, as long as the amplitudes of a scene differ by a factor of ten.
const PRIOR_SIGMA: [f64; 2] = [0.1, 1.5];
/// Standard deviation of the level beforehand, part of what the curve falls by: four of them are a curve that is real everywhere.
const LEVEL_SIGMA: f64 = 0.25;
/// Start of the value in the dark where no hyperbola is known, metre.
const START_M: f64 = 0.02;
/// Level over value in the dark beyond which the curve is none.
const LARGEST_LEVEL: f64 = 0.98;
/// Part of the pixels that are darker and brighter than the amplitudes that the start's knee is the middle of.
const BEYOND: f64 = 0.05;

/// The hyperbola in the numbers `D` (metre), `ln k` and `L` (metre), and which of them are estimated.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AmplitudeModel {
    /// Values of all; estimated ones have their start here.
    start: [f64; 3],
    /// Positions of the estimated ones.
    pub(super) free: Vec<usize>,
    /// Smallest and largest amplitude observed.
    span: [f64; 2],
}

impl AmplitudeModel {
    /// A start from the known hyperbola, or with the knee at the middle amplitude, its value in the dark alone estimated; `None` where
    /// the amplitudes do not differ by a factor of two, or are missing.
    pub(super) fn start(stations: &[StationPixels], known: Option<&AmplitudeHyperbola>) -> Option<Self> {
        let mut amplitudes: Vec<f64> =
            stations.iter().flat_map(|pixels| pixels.amplitudes.iter().map(|value| f64::from(*value))).collect();
        amplitudes.retain(|amplitude| *amplitude > 0.0 && amplitude.is_finite());
        amplitudes.sort_by(f64::total_cmp);
        let at = |part: f64| amplitudes.get((part * amplitudes.len() as f64) as usize).copied();
        let (dark, bright) = (at(BEYOND)?, at(1.0 - BEYOND)?);
        let span = [*amplitudes.first()?, *amplitudes.last()?];
        let known = known.filter(|known| known.h3 > 0.0 && known.h2 > 0.0);
        let start = known.map_or([START_M, 0.5 * (dark * bright).ln(), 0.0], |known| {
            let (in_the_dark, level) = (1.0 / known.h3.sqrt(), -known.h1 / known.h2);
            [in_the_dark - level, (1.0 / (known.h2 * in_the_dark)).ln(), level]
        });
        (bright > 2.0 * dark).then_some(Self { start, free: vec![0], span })
    }

    /// Estimates the shape as well, from a value in the dark over that in bright light; the level only beside an offset that takes what it
    /// changes.
    pub(super) fn shape(&mut self, in_the_dark: f64, beside_offset: bool) {
        self.start[0] = in_the_dark;
        self.free = if beside_offset { vec![0, 1, LEVEL] } else { vec![0, 1] };
    }

    /// Holds the level: without an offset it would change what is in bright light.
    pub(super) fn hold_level(&mut self) {
        self.free.retain(|position| *position != LEVEL);
    }

    /// Start and prior standard deviation of the estimated numbers.
    pub(super) fn prior(&self) -> impl Iterator<Item = (f64, f64)> {
        let sigma = |at: usize| PRIOR_SIGMA.get(at).copied().unwrap_or(LEVEL_SIGMA * self.start[0].abs());
        self.free.iter().map(move |at| (self.start[*at], sigma(*at)))
    }

    /// What the level has changed, which the offset has on top, metre; and the position of the level among the estimated numbers.
    pub(super) fn level_in_offset(&self, values: &[f64]) -> Option<(f64, usize)> {
        let at = self.free.iter().position(|position| *position == LEVEL)?;
        Some((values[at] - self.start[LEVEL], at))
    }

    /// All numbers, with those that are estimated.
    fn all(&self, values: &[f64]) -> [f64; 3] {
        let mut all = self.start;
        for (position, value) in self.free.iter().zip(values) {
            all[*position] = *value;
        }
        all
    }

    /// Correction (metre) at an amplitude less what the level has changed, and its derivatives by the estimated numbers, in their order.
    pub(super) fn correction(&self, amplitude: f64, values: &[f64], derivatives: &mut [f64; 3]) -> f64 {
        let [above, knee, level] = self.all(values);
        let dark = above + level;
        let (x, ratio) = (amplitude / knee.exp(), (level / dark).clamp(-LARGEST_LEVEL, LARGEST_LEVEL));
        let root = (x * x + 2.0 * ratio * x + 1.0).sqrt();
        let shape = (1.0 + 2.0 * ratio * x) / (root + x);
        let by_dark = shape - ratio * x / root;
        let by = [by_dark, dark * x * (1.0 - (x + ratio) / root), by_dark + x / root - 1.0];
        for (derivative, position) in derivatives.iter_mut().zip(&self.free) {
            *derivative = by[*position];
        }
        dark * shape - (level - self.start[LEVEL])
    }

    /// The hyperbola with these values of the estimated numbers; `None` where its value in the dark is not above its level.
    pub(super) fn hyperbola(&self, values: &[f64]) -> Option<AmplitudeHyperbola> {
        let [above, knee, level] = self.all(values);
        let dark = above + level;
        let h2 = 1.0 / (dark * knee.exp());
        let hyperbola =
            AmplitudeHyperbola { h1: 0.0 - level * h2, h2, h3: 1.0 / (dark * dark), amplitude_span: self.span };
        (dark > 0.0 && level.abs() < LARGEST_LEVEL * dark).then_some(hyperbola)
    }

    /// Derivatives of `h1, h2, h3` by `D, ln k, L`.
    pub(super) fn coefficients_by_numbers(&self, values: &[f64]) -> Matrix3<f64> {
        let [above, knee, level] = self.all(values);
        let dark = above + level;
        let h2 = 1.0 / (dark * knee.exp());
        let (h1_by_dark, h3_by_dark) = (level * h2 / dark, -2.0 / dark.powi(3));
        Matrix3::new(h1_by_dark, level * h2, h1_by_dark - h2, -h2 / dark, -h2, -h2 / dark, h3_by_dark, 0.0, h3_by_dark)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    const VALUES: [f64; 3] = [0.0838, 6.08, -0.0038];

    fn model() -> AmplitudeModel {
        AmplitudeModel { start: [0.0; 3], free: vec![0, 1, LEVEL], span: [1.0, 90_000.0] }
    }

    #[test]
    fn it_is_the_hyperbola_of_the_range_model() {
        let hyperbola = model().hyperbola(&VALUES).unwrap();
        let (level, _) = model().level_in_offset(&VALUES).unwrap();
        for amplitude in [3.0, 58.0, 1220.0, 25_534.0] {
            let found = model().correction(amplitude, &VALUES, &mut [0.0; 3]) + level;
            assert!((found - hyperbola.correction(amplitude).unwrap()).abs() < 1e-12, "{amplitude}");
        }
        let held = AmplitudeModel { start: VALUES, free: vec![0], ..model() };
        let found = held.correction(58.0, &VALUES[..1], &mut [0.0; 3]);
        assert!((found - hyperbola.correction(58.0).unwrap()).abs() < 1e-15);
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let moved = |k: usize, by: f64| {
            let mut values = VALUES;
            values[k] += by;
            values
        };
        for amplitude in [3.0, 20.0, 437.0, 4000.0, 20_000.0] {
            let mut derivatives = [0.0; 3];
            let _ = model().correction(amplitude, &VALUES, &mut derivatives);
            for (k, derivative) in derivatives.iter().enumerate() {
                let at = |by| model().correction(amplitude, &moved(k, by), &mut [0.0; 3]);
                let difference = (at(1e-6) - at(-1e-6)) / 2e-6;
                assert!((difference - derivative).abs() < 1e-7, "{amplitude} {k}: {difference} {derivative}");
            }
        }
        let by = model().coefficients_by_numbers(&VALUES);
        for k in 0..3 {
            let at = |by| {
                let found = model().hyperbola(&moved(k, by)).unwrap();
                nalgebra::Vector3::new(found.h1, found.h2, found.h3)
            };
            let difference = (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!((difference - by.column(k)).norm() < 1e-4 * by.column(k).norm(), "{k}");
        }
    }
}
