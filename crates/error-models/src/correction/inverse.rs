//! From the true range to the observed one, and whether there is only one.

use crate::models::steepest::steepest;
use crate::{Error, InterpolatedModel, PeriodicSpline, RangeErrorModel, RangePolynomial, Result};

/// Newton steps, or bisections where Newton leaves the bracket, until the inverse is given up. Bisection
/// alone needs about 60 for all digits.
const MOST_ITERATIONS: usize = 100;

impl RangeErrorModel {
    /// The range that the camera shows for a true range: the solution `ρ` of `ρ - Δρ(ρ, x, y, a) = r`, to
    /// machine precision. Arguments as for [`Self::correction`], the amplitude being the observed one.
    ///
    /// Groups that do not hold at the pixel are left out in the same way: a solution outside
    /// `range_span_m` gives the true range back. So the round trip is exact except within one correction of
    /// the edges of the span.
    ///
    /// Refuses arguments that are not finite and terms that are not monotone in the span.
    pub fn observed_range(&self, true_range_m: f64, x_mm: f64, y_mm: f64, amplitude: f64) -> Result<f64> {
        self.require_monotone()?;
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
        let constant = self.terms.d0 + self.by_position(x_mm, y_mm) + self.amplitude_correction(amplitude).0;
        let target = true_range_m + constant;
        if !target.is_finite() {
            return Err(Error::OutOfDomain {
                name: "true range with its constant correction",
                value: target,
                expected: "a finite range at a finite image point",
            });
        }
        let observed = self.invert_by_range(target)?;
        Ok(Some(observed).filter(|range_m| self.range_in_span(*range_m)))
    }

    /// Solves `ρ - Δρ(ρ) = target` by Newton's method inside a bracket that always holds the solution.
    fn invert_by_range(&self, target: f64) -> Result<f64> {
        let bound = self.bound_by_range();
        let mut bracket = [target - bound, target + bound];
        let mut observed = target + self.sum_by_range(target).0;
        let mut misclosure = f64::INFINITY;
        for _ in 0..MOST_ITERATIONS {
            let (by_range, derivative) = self.sum_by_range(observed);
            misclosure = observed - by_range - target;
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

    /// Refuses range-dependent terms that map two true ranges of the span to one observed range.
    pub(crate) fn require_monotone(&self) -> Result<()> {
        let Some(polynomial) = &self.further.polynomial else { return self.require_periodic_monotone() };
        let interval = self.ambiguity_interval_m;
        let periodic = match &self.further.spline {
            Some(spline) => spline.slope_bound(interval),
            None => self.terms.slope_bound(interval),
        };
        if periodic + polynomial.slope_bound() < 1.0 {
            return Ok(());
        }
        self.require_gentle(self.effective_range_span_m())
    }

    /// Without a polynomial one ambiguity interval stands for all.
    fn require_periodic_monotone(&self) -> Result<()> {
        let interval = self.ambiguity_interval_m;
        let Some(spline) = &self.further.spline else {
            return self.terms.require_monotone(interval, self.range_span_m);
        };
        if spline.slope_bound(interval) < 1.0 {
            return Ok(());
        }
        let span = self.range_span_m.filter(|[low, high]| high - low < interval);
        self.require_gentle(span.unwrap_or([0.0, interval]))
    }

    fn require_gentle(&self, span_m: [f64; 2]) -> Result<()> {
        let (slope, range_m) = steepest(span_m, self.ambiguity_interval_m, |range_m| self.sum_by_range(range_m).1);
        if slope < 1.0 { Ok(()) } else { Err(Error::NotMonotone { slope, range_m }) }
    }

    /// All terms that depend on the range, and their derivative.
    fn sum_by_range(&self, range_m: f64) -> (f64, f64) {
        let [periodic, polynomial] = self.by_range(range_m);
        (periodic.0 + polynomial.0, periodic.1 + polynomial.1)
    }

    /// No sum of terms that depend on the range is larger, metre.
    fn bound_by_range(&self) -> f64 {
        let periodic = self.further.spline.as_ref().map_or_else(|| self.terms.periodic_bound(), PeriodicSpline::bound);
        periodic + self.further.polynomial.as_ref().map_or(0.0, RangePolynomial::bound)
    }
}

impl InterpolatedModel {
    /// The range that the camera shows for a true range; arguments, errors and behaviour outside the spans as for
    /// [`RangeErrorModel::observed_range`].
    pub fn observed_range(&self, true_range_m: f64, x_mm: f64, y_mm: f64, amplitude: f64) -> Result<f64> {
        // The drift depends on nothing at the pixel: it is as if the scene were further away.
        let of = |model: &RangeErrorModel| {
            model.require_monotone()?;
            model.solve_observed_range(true_range_m + self.drift_m, x_mm, y_mm, amplitude)
        };
        let Some(shorter) = of(&self.shorter)? else { return Ok(true_range_m) };
        let Some((longer, _)) = &self.longer else { return Ok(shorter) };
        let Some(longer) = of(longer)? else { return Ok(true_range_m) };
        // Both misclosures grow with the range, and so does their blend: its zero lies between theirs.
        let mut bracket = [shorter.min(longer), shorter.max(longer)];
        let mut observed = f64::midpoint(shorter, longer);
        let mut misclosure = f64::INFINITY;
        for _ in 0..MOST_ITERATIONS {
            let correction = self.correction(observed, x_mm, y_mm, amplitude);
            misclosure = observed - correction.total_m() - true_range_m;
            // Four units in the last place: what rounding leaves.
            let resolution = 4.0 * f64::EPSILON * observed.abs().max(1.0);
            if misclosure.abs() <= resolution || bracket[1] - bracket[0] <= resolution {
                return Ok(observed);
            }
            bracket[usize::from(misclosure > 0.0)] = observed;
            let newton = observed - misclosure / (1.0 - correction.range_derivative);
            let inside = newton > bracket[0] && newton < bracket[1];
            observed = if inside { newton } else { f64::midpoint(bracket[0], bracket[1]) };
        }
        Err(Error::NotConverged { true_range_m, misclosure_m: misclosure })
    }
}
