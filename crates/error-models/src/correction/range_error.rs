//! Eqs. 14 and 15 together at one pixel: value, correction and its inverse.

use crate::error::require_span;
use crate::{Error, RangeErrorModel, Result};

/// Beyond so many ambiguity intervals a single-precision range no longer tells the phase to a thousandth
/// of a turn; such a pixel is treated as outside the span.
pub(crate) const MOST_INTERVALS: f64 = 4096.0;

/// The correction of one range, by group of terms. It is what is **subtracted** from the observed range.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RangeCorrection {
    /// d0, metre.
    pub offset_m: f64,
    /// d2..d7 or the spline, metre.
    pub periodic_m: f64,
    /// e1, e2 or the surface, metre.
    pub delay_m: f64,
    /// Polynomial in range, metre.
    pub polynomial_m: f64,
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
        self.offset_m + self.periodic_m + self.delay_m + self.polynomial_m + self.amplitude_m
    }
}

impl RangeErrorModel {
    /// The correction that belongs to an observed range (m), image coordinates from the principal point
    /// (mm) and amplitude (camera's unit). The amplitude does not matter where there is no hyperbola.
    ///
    /// Nothing is extrapolated:
    /// - Outside `range_span_m`, or the span of the polynomial, every group is zero: the pixel keeps its observed range.
    /// - Outside the amplitude span, or where the radicand of Eq. 15 is negative or the amplitude NaN, the
    ///   hyperbola alone is left out: the pixel keeps its range corrected by Eq. 14. (The hyperbola is
    ///   fitted to what Eq. 14 leaves over, so Eq. 14 holds without it, but not the other way round.)
    /// - Outside the spans of a surface its value at the nearest edge is taken.
    ///
    /// All say so in [`RangeCorrection::outside_span`].
    pub fn correction(&self, range_m: f64, x_mm: f64, y_mm: f64, amplitude: f64) -> RangeCorrection {
        if !self.range_in_span(range_m) {
            return RangeCorrection { outside_span: true, ..RangeCorrection::default() };
        }
        let (amplitude_m, no_amplitude) = self.amplitude_correction(amplitude);
        let off_surface = self.further.surface.as_ref().is_some_and(|surface| !surface.in_span(x_mm, y_mm));
        let [(periodic_m, of_periodic), (polynomial_m, of_polynomial)] = self.by_range(range_m);
        RangeCorrection {
            offset_m: self.terms.d0,
            periodic_m,
            delay_m: self.by_position(x_mm, y_mm),
            polynomial_m,
            amplitude_m,
            range_derivative: of_periodic + of_polynomial,
            outside_span: no_amplitude || off_surface,
        }
    }

    /// `ρ - Δρ(ρ, x, y, a)` in metre; arguments and behaviour outside the span as for [`Self::correction`].
    pub fn corrected_range(&self, range_m: f64, x_mm: f64, y_mm: f64, amplitude: f64) -> f64 {
        range_m - self.correction(range_m, x_mm, y_mm, amplitude).total_m()
    }

    /// Periodic terms and polynomial, each with its derivative with respect to the range.
    pub(crate) fn by_range(&self, range_m: f64) -> [(f64, f64); 2] {
        let interval = self.ambiguity_interval_m;
        let periodic = match &self.further.spline {
            Some(spline) => spline.with_derivative(interval, range_m),
            None => self.terms.periodic_with_derivative(interval, range_m),
        };
        let polynomial = self.further.polynomial.as_ref().map_or((0.0, 0.0), |terms| terms.with_derivative(range_m));
        [periodic, polynomial]
    }

    /// Signal propagation delay or surface, metre.
    pub(crate) fn by_position(&self, x_mm: f64, y_mm: f64) -> f64 {
        match &self.further.surface {
            Some(surface) => surface.value(x_mm, y_mm),
            None => self.terms.delay(x_mm, y_mm),
        }
    }

    /// Eq. 15 in metre, and whether it had to be left out.
    pub(crate) fn amplitude_correction(&self, amplitude: f64) -> (f64, bool) {
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

    /// The range span, also that of a polynomial, cut to the intervals whose phase a single-precision range can tell.
    pub(crate) fn effective_range_span_m(&self) -> [f64; 2] {
        let furthest = MOST_INTERVALS * self.ambiguity_interval_m;
        let polynomial = self.further.polynomial.as_ref().map(|terms| terms.range_span_m);
        let spans = [self.range_span_m, polynomial].into_iter().flatten();
        spans.fold([-furthest, furthest], |[low, high], span| [low.max(span[0]), high.min(span[1])])
    }

    /// Refuses an ambiguity interval that is not positive and finite, coefficients that are not finite,
    /// bad spans, a hyperbola with `h3 = 0`, sines beside a spline, e1 or e2 beside a surface, and terms so large that the observed range no longer
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
        self.further.validate_beside(&self.terms)?;
        self.require_monotone()
    }
}
