//! Eq. 14: offset, periodic terms and signal propagation delay.

use std::f64::consts::PI;

use crate::error::require_finite;
use crate::models::steepest::steepest;
use crate::{Error, RangeTerms, Result};

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

    /// The three pairs of periodic terms apart, wavelengths U, U/2, U/4, metre.
    pub(crate) fn waves(&self, ambiguity_interval_m: f64, range_m: f64) -> [f64; 3] {
        let [first, second, third] = waves(ambiguity_interval_m, range_m);
        let [d2, d3, d4, d5, d6, d7] = self.periodic;
        [(d2, d3, first), (d4, d5, second), (d6, d7, third)]
            .map(|(d_sin, d_cos, wave)| d_sin * wave.sin + d_cos * wave.cos)
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
        if self.slope_bound(ambiguity_interval_m) < 1.0 {
            return Ok(());
        }
        let span = range_span_m.filter(|[low, high]| high - low < ambiguity_interval_m);
        let (slope, range_m) = steepest(span.unwrap_or([0.0, ambiguity_interval_m]), ambiguity_interval_m, |range_m| {
            self.range_derivative(ambiguity_interval_m, range_m)
        });
        if slope < 1.0 { Ok(()) } else { Err(Error::NotMonotone { slope, range_m }) }
    }

    /// No derivative of the periodic terms with respect to the range is larger.
    pub(crate) fn slope_bound(&self, ambiguity_interval_m: f64) -> f64 {
        let steepest = pairs(&self.periodic).zip(waves(ambiguity_interval_m, 0.0));
        steepest.map(|([d_sin, d_cos], wave)| wave.number_rad_per_m * d_sin.hypot(d_cos)).sum()
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
