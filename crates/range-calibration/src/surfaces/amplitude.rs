//! The amplitude hyperbola of Eq. 15 by numbers that surfaces tell almost linearly.
//!
//! With its value `Z` in the dark, its level `L` in bright light and the amplitude `k` of the knee between them,
//! `h3 = 1/Z²`, `h2 = 1/(Z k)`, `h1 = -L h2`, and for `x = a/k`, `l = L/Z` Eq. 15 reads `Δρ = Z (√(x² + 2 l x + 1) - x)`, which is
//! real at all amplitudes where `|l| <= 1`. The coefficients themselves leave the reals on the way.
//!
//! The level is held, at that of the known hyperbola or at zero: surfaces do not tell it from `d0`, as both together shift what is in
//! bright light and the value in the dark takes the difference. Estimated with it, `d0` of a room was known to 1.9 mm instead of
//! 0.1, while what is taken off stayed the same to 0.3 mm.

use error_models::AmplitudeHyperbola;
use nalgebra::Matrix3x2;

use super::pixels::StationPixels;

/// Names of the numbers that are estimated.
pub(super) const NAMES: [&str; 2] = ["amplitude: value in the dark", "amplitude: knee"];
/// Standard deviation of the value in the dark beforehand, metre, and of the knee's logarithm: cameras err by less than a
/// decimetre, and their knees lie within a factor of twenty of the middle amplitude. Half or twice as much moves estimates by less
/// than their deviations, as long as the amplitudes of a scene differ by a factor of ten.
pub(super) const PRIOR_SIGMA: [f64; 2] = [0.1, 1.5];
/// Start of the value in the dark where no hyperbola is known, metre.
const START_M: f64 = 0.02;
/// Level over value in the dark beyond which the curve is none.
const LARGEST_LEVEL: f64 = 0.98;
/// Part of the pixels that are darker and brighter than the amplitudes that the start's knee is the middle of.
const BEYOND: f64 = 0.05;

/// The hyperbola in the numbers `Z` (metre) and `ln k`, and which of them are estimated.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AmplitudeModel {
    /// Values of both; estimated ones have their start here.
    pub(super) start: [f64; 2],
    /// Positions of the estimated ones.
    pub(super) free: Vec<usize>,
    /// Level in bright light, metre.
    level_m: f64,
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
        let start = known.map_or([START_M, 0.5 * (dark * bright).ln()], |known| {
            let in_the_dark = 1.0 / known.h3.sqrt();
            [in_the_dark, (1.0 / (known.h2 * in_the_dark)).ln()]
        });
        let level_m = known.map_or(0.0, |known| -known.h1 / known.h2);
        (bright > 2.0 * dark).then_some(Self { start, level_m, free: vec![0], span })
    }

    /// Both numbers, with those that are estimated.
    fn all(&self, values: &[f64]) -> [f64; 2] {
        let mut all = self.start;
        for (position, value) in self.free.iter().zip(values) {
            all[*position] = *value;
        }
        all
    }

    /// Correction (metre) at an amplitude and its derivatives by the estimated numbers, in their order.
    pub(super) fn correction(&self, amplitude: f64, values: &[f64], derivatives: &mut [f64; 2]) -> f64 {
        let [dark, knee] = self.all(values);
        let (x, ratio) = (amplitude / knee.exp(), (self.level_m / dark).clamp(-LARGEST_LEVEL, LARGEST_LEVEL));
        let root = (x * x + 2.0 * ratio * x + 1.0).sqrt();
        let shape = (1.0 + 2.0 * ratio * x) / (root + x);
        let by = [shape - ratio * x / root, dark * x * (1.0 - (x + ratio) / root)];
        for (derivative, position) in derivatives.iter_mut().zip(&self.free) {
            *derivative = by[*position];
        }
        dark * shape
    }

    /// The hyperbola with these values of the estimated numbers; `None` where its value in the dark is not above its level.
    pub(super) fn hyperbola(&self, values: &[f64]) -> Option<AmplitudeHyperbola> {
        let ([dark, knee], level) = (self.all(values), self.level_m);
        let h2 = 1.0 / (dark * knee.exp());
        let hyperbola =
            AmplitudeHyperbola { h1: 0.0 - level * h2, h2, h3: 1.0 / (dark * dark), amplitude_span: self.span };
        (dark > 0.0 && level.abs() < LARGEST_LEVEL * dark).then_some(hyperbola)
    }

    /// Derivatives of `h1, h2, h3` by `Z, ln k`.
    pub(super) fn coefficients_by_numbers(&self, values: &[f64]) -> Matrix3x2<f64> {
        let ([dark, knee], level) = (self.all(values), self.level_m);
        let h2 = 1.0 / (dark * knee.exp());
        Matrix3x2::new(level * h2 / dark, level * h2, -h2 / dark, -h2, -2.0 / dark.powi(3), 0.0)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    const VALUES: [f64; 2] = [0.08, 6.08];

    fn model() -> AmplitudeModel {
        AmplitudeModel { start: [0.0; 2], level_m: -0.0038, free: vec![0, 1], span: [1.0, 90_000.0] }
    }

    #[test]
    fn it_is_the_hyperbola_of_the_range_model() {
        let hyperbola = model().hyperbola(&VALUES).unwrap();
        for amplitude in [3.0, 58.0, 1220.0, 25_534.0] {
            let found = model().correction(amplitude, &VALUES, &mut [0.0; 2]);
            assert!((found - hyperbola.correction(amplitude).unwrap()).abs() < 1e-12, "{amplitude}");
        }
        let held = AmplitudeModel { start: VALUES, free: vec![0], ..model() };
        let [one, other] = [(held, &VALUES[..1]), (model(), &VALUES[..])]
            .map(|(model, values)| model.correction(58.0, values, &mut [0.0; 2]));
        assert!((one - other).abs() < 1e-15);
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let moved = |k: usize, by: f64| {
            let mut values = VALUES;
            values[k] += by;
            values
        };
        for amplitude in [3.0, 20.0, 437.0, 4000.0, 20_000.0] {
            let mut derivatives = [0.0; 2];
            let _ = model().correction(amplitude, &VALUES, &mut derivatives);
            for (k, derivative) in derivatives.iter().enumerate() {
                let at = |by| model().correction(amplitude, &moved(k, by), &mut [0.0; 2]);
                let difference = (at(1e-6) - at(-1e-6)) / 2e-6;
                assert!((difference - derivative).abs() < 1e-7, "{amplitude} {k}: {difference} {derivative}");
            }
        }
        let by = model().coefficients_by_numbers(&VALUES);
        for k in 0..2 {
            let at = |by| {
                let found = model().hyperbola(&moved(k, by)).unwrap();
                nalgebra::Vector3::new(found.h1, found.h2, found.h3)
            };
            let difference = (at(1e-6) - at(-1e-6)) / 2e-6;
            assert!((difference - by.column(k)).norm() < 1e-4 * by.column(k).norm(), "{k}");
        }
    }
}
