//! Eq. 14: offset, periodic terms and signal propagation delay.

use std::f64::consts::PI;

use crate::error::require_finite;
use crate::{Error, RangeTerms, Result};

/// Samples of one period in the search for the steepest place; the shortest wavelength gets a quarter of them.
const SLOPE_SAMPLES: u32 = 512;

impl RangeTerms {
    /// Names of the nine parameters in the order of [`Self::design_row`] and [`Self::to_array`].
    pub const NAMES: [&'static str; 9] = ["d0", "d2", "d3", "d4", "d5", "d6", "d7", "e1", "e2"];

    /// The parameters in the order of [`Self::NAMES`].
    pub fn to_array(&self) -> [f64; 9] {
        let [d2, d3, d4, d5, d6, d7] = self.periodic;
        [self.d0, d2, d3, d4, d5, d6, d7, self.e1, self.e2]
    }

    /// Terms from parameters in the order of [`Self::NAMES`].
    pub fn from_array([d0, d2, d3, d4, d5, d6, d7, e1, e2]: [f64; 9]) -> Self {
        Self { d0, periodic: [d2, d3, d4, d5, d6, d7], e1, e2 }
    }

    /// `Δρ` of Eq. 14 in metre.
    ///
    /// `ambiguity_interval_m` is U, `range_m` the observed range, which may be larger than U;
    /// `x_mm` and `y_mm` are image coordinates from the principal point in millimetre.
    pub fn correction(&self, ambiguity_interval_m: f64, range_m: f64, x_mm: f64, y_mm: f64) -> f64 {
        self.d0 + self.periodic_correction(ambiguity_interval_m, range_m) + self.delay(x_mm, y_mm)
    }

    /// The six periodic terms alone, metre.
    pub fn periodic_correction(&self, ambiguity_interval_m: f64, range_m: f64) -> f64 {
        self.periodic_with_derivative(ambiguity_interval_m, range_m).0
    }

    /// `∂Δρ/∂ρ`, metre per metre. The derivatives with respect to x and y are `e1` and `e2`.
    pub fn range_derivative(&self, ambiguity_interval_m: f64, range_m: f64) -> f64 {
        self.periodic_with_derivative(ambiguity_interval_m, range_m).1
    }

    /// The periodic terms and their derivative from one sine and cosine.
    pub(crate) fn periodic_with_derivative(&self, ambiguity_interval_m: f64, range_m: f64) -> (f64, f64) {
        let pairs = pairs(&self.periodic).zip(waves(ambiguity_interval_m, range_m));
        pairs.fold((0.0, 0.0), |(value, derivative), ([d_sin, d_cos], wave)| {
            let change = wave.number_rad_per_m * (d_sin * wave.cos - d_cos * wave.sin);
            (value + (d_sin * wave.sin + d_cos * wave.cos), derivative + change)
        })
    }

    /// The signal propagation delay alone, metre: `e1 x + e2 y`.
    pub fn delay(&self, x_mm: f64, y_mm: f64) -> f64 {
        self.e1 * x_mm + self.e2 * y_mm
    }

    /// `∂Δρ/∂(d0, d2..d7, e1, e2)`; as Eq. 14 is linear, `Δρ` is its product with [`Self::to_array`].
    pub fn design_row(ambiguity_interval_m: f64, range_m: f64, x_mm: f64, y_mm: f64) -> [f64; 9] {
        let [first, second, third] = waves(ambiguity_interval_m, range_m);
        [1.0, first.sin, first.cos, second.sin, second.cos, third.sin, third.cos, x_mm, y_mm]
    }

    /// Sum of the amplitudes of the three periodic pairs, metre: no periodic correction is larger.
    pub fn periodic_bound(&self) -> f64 {
        pairs(&self.periodic).map(|[d_sin, d_cos]| d_sin.hypot(d_cos)).sum()
    }

    /// Refuses values that are not finite.
    pub fn validate(&self) -> Result<()> {
        Self::NAMES.iter().zip(self.to_array()).try_for_each(|(name, value)| require_finite(name, value))
    }

    /// Refuses periodic terms that map two true ranges of the span to one observed range.
    ///
    /// `range_span_m` is where it matters; `None` stands for everywhere.
    pub fn require_monotone(&self, ambiguity_interval_m: f64, range_span_m: Option<[f64; 2]>) -> Result<()> {
        let bound: f64 = pairs(&self.periodic)
            .zip(waves(ambiguity_interval_m, 0.0))
            .map(|([d_sin, d_cos], wave)| wave.number_rad_per_m * d_sin.hypot(d_cos))
            .sum();
        if bound < 1.0 {
            return Ok(());
        }
        let (slope, range_m) = self.steepest(ambiguity_interval_m, range_span_m);
        if slope < 1.0 { Ok(()) } else { Err(Error::NotMonotone { slope, range_m }) }
    }

    /// Largest `∂Δρ/∂ρ` and where it is: the best of dense samples, then golden-section search around it.
    fn steepest(&self, ambiguity_interval_m: f64, range_span_m: Option<[f64; 2]>) -> (f64, f64) {
        let [low, high] = match range_span_m {
            Some([low, high]) if high - low < ambiguity_interval_m => [low, high],
            _ => [0.0, ambiguity_interval_m],
        };
        let slope = |range_m: f64| self.range_derivative(ambiguity_interval_m, range_m);
        let step = (high - low) / f64::from(SLOPE_SAMPLES);
        let samples = (0..=SLOPE_SAMPLES).map(|i| low + f64::from(i) * step);
        let best = samples.max_by(|a, b| slope(*a).total_cmp(&slope(*b))).unwrap_or(low);
        let mut bracket = [(best - step).max(low), (best + step).min(high)];
        let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
        for _ in 0..50 {
            let width = golden * (bracket[1] - bracket[0]);
            let inner = [bracket[1] - width, bracket[0] + width];
            if slope(inner[0]) > slope(inner[1]) {
                bracket[1] = inner[1];
            } else {
                bracket[0] = inner[0];
            }
        }
        let refined = f64::midpoint(bracket[0], bracket[1]);
        [best, refined].map(|range_m| (slope(range_m), range_m)).into_iter().fold(
            (f64::NEG_INFINITY, best),
            |largest, candidate| if candidate.0 > largest.0 { candidate } else { largest },
        )
    }
}

/// Sine and cosine of one of the three wavelengths at a range.
#[derive(Clone, Copy)]
struct Wave {
    sin: f64,
    cos: f64,
    number_rad_per_m: f64,
}

/// The waves of lengths U, U/2 and U/4: one sine and cosine, doubled twice.
fn waves(ambiguity_interval_m: f64, range_m: f64) -> [Wave; 3] {
    let number_rad_per_m = 2.0 * PI / ambiguity_interval_m;
    // Whole intervals are taken off first, so that the phase keeps its digits far beyond U.
    let intervals = range_m / ambiguity_interval_m;
    let (sin, cos) = (2.0 * PI * (intervals - intervals.round())).sin_cos();
    let first = Wave { sin, cos, number_rad_per_m };
    let second = first.octave();
    [first, second, second.octave()]
}

impl Wave {
    /// The wave of half the length, by the double-angle formulas.
    fn octave(self) -> Self {
        Self {
            sin: 2.0 * self.sin * self.cos,
            cos: (self.cos - self.sin) * (self.cos + self.sin),
            number_rad_per_m: 2.0 * self.number_rad_per_m,
        }
    }
}

/// The periodic coefficients as pairs of sine and cosine.
fn pairs(periodic: &[f64; 6]) -> impl Iterator<Item = [f64; 2]> {
    let [d2, d3, d4, d5, d6, d7] = *periodic;
    [[d2, d3], [d4, d5], [d6, d7]].into_iter()
}
