//! Eqs. 14 and 15 together at one pixel: value, correction and its inverse.

use crate::error::require_span;
use crate::{Error, RangeErrorModel, Result};

/// Beyond so many ambiguity intervals a single-precision range no longer tells the phase to a thousandth
/// of a turn; such a pixel is treated as outside the span.
pub(crate) const MOST_INTERVALS: f64 = 4096.0;

/// Newton steps, or bisections where Newton leaves the bracket, until the inverse is given up. Bisection
/// alone needs about 60 for all digits.
const MOST_ITERATIONS: usize = 100;

/// The correction of one range, by group of terms. It is what is **subtracted** from the observed range.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RangeCorrection {
    /// d0, metre.
    pub offset_m: f64,
    /// d2..d7, metre.
    pub periodic_m: f64,
    /// e1, e2, metre.
    pub delay_m: f64,
    /// Hyperbola (Eq. 15), metre.
    pub amplitude_m: f64,
    /// Derivative of the whole correction with respect to the observed range, metre per metre.
    pub range_derivative: f64,
    /// Whether range or amplitude are outside the span of the model; see [`RangeErrorModel::correction`]
    /// for what was left out.
    pub outside_span: bool,
}

impl RangeCorrection {
    /// Sum of all groups, metre.
    pub fn total_m(&self) -> f64 {
        self.offset_m + self.periodic_m + self.delay_m + self.amplitude_m
    }
}

impl RangeErrorModel {
    /// The correction that belongs to an observed range (m), image coordinates from the principal point
    /// (mm) and amplitude (camera's unit). The amplitude does not matter where there is no hyperbola.
    ///
    /// Nothing is extrapolated:
    /// - Outside `range_span_m` every group is zero: the pixel keeps its observed range.
    /// - Outside the amplitude span, or where the radicand of Eq. 15 is negative or the amplitude NaN, the
    ///   hyperbola alone is left out: the pixel keeps its range corrected by Eq. 14. (The hyperbola is
    ///   fitted to what Eq. 14 leaves over, so Eq. 14 holds without it, but not the other way round.)
    ///
    /// Both say so in [`RangeCorrection::outside_span`].
    pub fn correction(&self, range_m: f64, x_mm: f64, y_mm: f64, amplitude: f64) -> RangeCorrection {
        if !self.range_in_span(range_m) {
            return RangeCorrection { outside_span: true, ..RangeCorrection::default() };
        }
        let (amplitude_m, outside_span) = self.amplitude_correction(amplitude);
        let (periodic_m, range_derivative) = self.terms.periodic_with_derivative(self.ambiguity_interval_m, range_m);
        RangeCorrection {
            offset_m: self.terms.d0,
            periodic_m,
            delay_m: self.terms.delay(x_mm, y_mm),
            amplitude_m,
            range_derivative,
            outside_span,
        }
    }

    /// `ρ - Δρ(ρ, x, y, a)` in metre; arguments and behaviour outside the span as for [`Self::correction`].
    pub fn corrected_range(&self, range_m: f64, x_mm: f64, y_mm: f64, amplitude: f64) -> f64 {
        range_m - self.correction(range_m, x_mm, y_mm, amplitude).total_m()
    }

    /// The range that the camera shows for a true range: the solution `ρ` of `ρ - Δρ(ρ, x, y, a) = r`, to
    /// machine precision. Arguments as for [`Self::correction`], the amplitude being the observed one.
    ///
    /// Groups that do not hold at the pixel are left out in the same way: a solution outside
    /// `range_span_m` gives the true range back. So the round trip is exact except within one correction of
    /// the edges of the span.
    ///
    /// Refuses arguments that are not finite and terms that are not monotone in the span.
    pub fn observed_range(&self, true_range_m: f64, x_mm: f64, y_mm: f64, amplitude: f64) -> Result<f64> {
        self.terms.require_monotone(self.ambiguity_interval_m, self.range_span_m)?;
        let observed = self.solve_observed_range(true_range_m, x_mm, y_mm, amplitude)?;
        Ok(observed.unwrap_or(true_range_m))
    }

    /// [`Self::observed_range`] of a model already known to be monotone; `None` if it is outside the span.
    pub(crate) fn solve_observed_range(
        &self,
        true_range_m: f64,
        x_mm: f64,
        y_mm: f64,
        amplitude: f64,
    ) -> Result<Option<f64>> {
        let constant = self.terms.d0 + self.terms.delay(x_mm, y_mm) + self.amplitude_correction(amplitude).0;
        let target = true_range_m + constant;
        if !target.is_finite() {
            return Err(Error::OutOfDomain {
                name: "true range with its constant correction",
                value: target,
                expected: "a finite range at a finite image point",
            });
        }
        let observed = self.invert_periodic(target)?;
        Ok(Some(observed).filter(|range_m| self.range_in_span(*range_m)))
    }

    /// Solves `ρ - periodic(ρ) = target` by Newton's method inside a bracket that always holds the solution.
    fn invert_periodic(&self, target: f64) -> Result<f64> {
        let interval = self.ambiguity_interval_m;
        let bound = self.terms.periodic_bound();
        let mut bracket = [target - bound, target + bound];
        let mut observed = target + self.terms.periodic_correction(interval, target);
        let mut misclosure = f64::INFINITY;
        for _ in 0..MOST_ITERATIONS {
            let (periodic, derivative) = self.terms.periodic_with_derivative(interval, observed);
            misclosure = observed - periodic - target;
            bracket[usize::from(misclosure > 0.0)] = observed;
            let newton = observed - misclosure / (1.0 - derivative);
            let inside = newton > bracket[0] && newton < bracket[1];
            let next = if inside { newton } else { f64::midpoint(bracket[0], bracket[1]) };
            // Four units in the last place of the largest number met: what rounding leaves of the misclosure.
            let resolution = 4.0 * f64::EPSILON * target.abs().max(bound).max(observed.abs());
            if misclosure.abs() <= resolution || bracket[1] - bracket[0] <= resolution {
                return Ok(observed);
            }
            observed = next;
        }
        Err(Error::NotConverged { true_range_m: target, misclosure_m: misclosure })
    }

    /// Eq. 15 in metre, and whether it had to be left out.
    fn amplitude_correction(&self, amplitude: f64) -> (f64, bool) {
        match self.hyperbola.map(|hyperbola| hyperbola.correction(amplitude)) {
            None => (0.0, false),
            Some(None) => (0.0, true),
            Some(Some(value)) => (value, false),
        }
    }

    /// Whether the model says something about this observed range. NaN is in no span.
    pub fn range_in_span(&self, range_m: f64) -> bool {
        let [low, high] = self.effective_range_span_m();
        range_m >= low && range_m <= high
    }

    /// The range span, cut to the intervals whose phase a single-precision range can tell.
    pub(crate) fn effective_range_span_m(&self) -> [f64; 2] {
        let furthest = MOST_INTERVALS * self.ambiguity_interval_m;
        let [low, high] = self.range_span_m.unwrap_or([-furthest, furthest]);
        [low.max(-furthest), high.min(furthest)]
    }

    /// Refuses an ambiguity interval that is not positive and finite, coefficients that are not finite,
    /// bad spans, a hyperbola with `h3 = 0`, and periodic terms so large that the observed range no longer
    /// grows with the true one.
    pub fn validate(&self) -> Result<()> {
        if !(self.ambiguity_interval_m.is_finite() && self.ambiguity_interval_m > 0.0) {
            return Err(Error::OutOfDomain {
                name: "ambiguity_interval_m",
                value: self.ambiguity_interval_m,
                expected: "an ambiguity interval is positive and finite",
            });
        }
        self.terms.validate()?;
        self.range_span_m.map_or(Ok(()), |span| require_span("range_span_m", span))?;
        self.hyperbola.map_or(Ok(()), |hyperbola| hyperbola.validate())?;
        self.terms.require_monotone(self.ambiguity_interval_m, self.range_span_m)
    }
}
