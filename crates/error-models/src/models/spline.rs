//! A periodic cubic B-spline over the ambiguity interval, instead of the sines of Eq. 14.

use crate::error::{require_count, require_finite};
use crate::{PeriodicSpline, Result};

impl PeriodicSpline {
    /// Least and largest number of knots.
    pub const KNOTS: [usize; 2] = [4, 256];

    /// The spline that is zero everywhere, with this number of knots; refuses one outside [`Self::KNOTS`].
    pub fn zero(knots: usize) -> Result<Self> {
        require_count("spline_knots", knots, Self::KNOTS)?;
        Ok(Self { coefficients: vec![0.0; knots - 1] })
    }

    /// Number of knots in an ambiguity interval.
    pub fn knots(&self) -> usize {
        self.coefficients.len() + 1
    }

    /// Coefficient of a knot, the last one among them.
    pub(crate) fn at_knot(&self, knot: usize) -> f64 {
        self.coefficients.get(knot).copied().unwrap_or_else(|| -self.coefficients.iter().sum::<f64>())
    }

    /// `Δρ` in metre and `∂Δρ/∂ρ` at a range, which may be larger than the ambiguity interval.
    pub fn with_derivative(&self, ambiguity_interval_m: f64, range_m: f64) -> (f64, f64) {
        let local = Local::at(self.knots(), ambiguity_interval_m, range_m);
        let mut sum = (0.0, 0.0);
        for (place, knot) in local.knots.into_iter().enumerate() {
            let coefficient = self.at_knot(knot);
            sum.0 += coefficient * local.value[place];
            sum.1 += coefficient * local.derivative[place];
        }
        sum
    }

    /// `∂Δρ/∂(s0..)`: `B_i − B_last`, as the last coefficient is minus the sum of the others. `row` has one place for
    /// each coefficient; places beyond them are left alone.
    pub fn design_row(&self, ambiguity_interval_m: f64, range_m: f64, row: &mut [f64]) {
        let free = self.coefficients.len();
        let local = Local::at(self.knots(), ambiguity_interval_m, range_m);
        let last = local.knots.iter().zip(local.value).filter(|(knot, _)| **knot == free).map(|(_, value)| value);
        let of_last: f64 = last.sum();
        let free = free.min(row.len());
        row[..free].fill(-of_last);
        for (knot, value) in local.knots.into_iter().zip(local.value) {
            if let Some(place) = row[..free].get_mut(knot) {
                *place += value;
            }
        }
    }

    /// No value of the spline is larger, metre.
    pub fn bound(&self) -> f64 {
        (0..self.knots()).map(|knot| self.at_knot(knot).abs()).fold(0.0, f64::max)
    }

    /// No derivative with respect to the range is larger.
    pub(crate) fn slope_bound(&self, ambiguity_interval_m: f64) -> f64 {
        let knots = self.knots();
        let step = |knot: usize| (self.at_knot((knot + 1) % knots) - self.at_knot(knot)).abs();
        (0..knots).map(step).fold(0.0, f64::max) * knots as f64 / ambiguity_interval_m
    }

    /// Between knot k and the next, with `u` from 0 to 1: `a + u (b + u (c + u d))`, for each knot.
    pub(crate) fn pieces(&self) -> impl Iterator<Item = [f64; 4]> + '_ {
        let knots = self.knots();
        (0..knots).map(move |knot| {
            let [p, q, r, s] = neighbours(knot, knots).map(|knot| self.at_knot(knot));
            [(p + 4.0 * q + r) / 6.0, (r - p) / 2.0, f64::midpoint(p, r) - q, (s - p + 3.0 * (q - r)) / 6.0]
        })
    }

    /// Refuses a number of knots outside [`Self::KNOTS`] and coefficients that are not finite.
    pub fn validate(&self) -> Result<()> {
        require_count("spline_knots", self.knots(), Self::KNOTS)?;
        self.coefficients.iter().try_for_each(|value| require_finite("spline coefficient", *value))
    }
}

/// The four B-splines that are not zero at a range.
struct Local {
    knots: [usize; 4],
    value: [f64; 4],
    derivative: [f64; 4],
}

impl Local {
    fn at(knots: usize, ambiguity_interval_m: f64, range_m: f64) -> Self {
        let intervals = range_m / ambiguity_interval_m;
        let position = (intervals - intervals.floor()) * knots as f64;
        // Rounding may reach the next interval's first knot; a range that is not finite is at knot 0 with NaN weights.
        let knot = (position as usize).min(knots - 1);
        let u = position - knot as f64;
        let w = 1.0 - u;
        let per_m = knots as f64 / ambiguity_interval_m;
        Self {
            knots: neighbours(knot, knots),
            value: [
                w * w * w / 6.0,
                (u * u * (3.0 * u - 6.0) + 4.0) / 6.0,
                (w * w * (3.0 * w - 6.0) + 4.0) / 6.0,
                u * u * u / 6.0,
            ],
            derivative: [-w * w / 2.0, u * (3.0 * u - 4.0) / 2.0, -w * (3.0 * w - 4.0) / 2.0, u * u / 2.0]
                .map(|by_knot| by_knot * per_m),
        }
    }
}

/// A knot with the one before it and the two after it.
fn neighbours(knot: usize, knots: usize) -> [usize; 4] {
    [(knot + knots - 1) % knots, knot, (knot + 1) % knots, (knot + 2) % knots]
}
