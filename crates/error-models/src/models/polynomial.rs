//! A polynomial in range, for what neither offset nor periodic terms hold (a scale error, heating of a long range).

use crate::error::{require_count, require_finite, require_span};
use crate::models::legendre::{Legendre, MOST_ORDER};
use crate::{PolynomialShape, RangePolynomial, Result};

impl RangePolynomial {
    /// Lowest and highest order.
    pub const ORDERS: [usize; 2] = [1, MOST_ORDER];

    /// The polynomial that is zero everywhere; refuses an order outside [`Self::ORDERS`] and a bad span.
    pub fn zero(shape: &PolynomialShape) -> Result<Self> {
        require_count("polynomial order", shape.order, Self::ORDERS)?;
        let zero = Self { range_span_m: shape.range_span_m, coefficients: vec![0.0; shape.order] };
        zero.validate()?;
        Ok(zero)
    }

    /// Order and span.
    pub fn shape(&self) -> PolynomialShape {
        PolynomialShape { order: self.coefficients.len(), range_span_m: self.range_span_m }
    }

    /// `Δρ` in metre and `∂Δρ/∂ρ` at a range. Beyond the span the value stays as it is at its end.
    pub fn with_derivative(&self, range_m: f64) -> (f64, f64) {
        let basis = Legendre::on_span(self.range_span_m, range_m);
        let terms = self.coefficients.iter().zip(basis.value.iter().zip(basis.derivative).skip(1));
        terms.fold((0.0, 0.0), |sum, (q, (value, derivative))| (sum.0 + q * value, sum.1 + q * derivative))
    }

    /// `∂Δρ/∂(q1..)`. `row` has one place for each coefficient; places beyond them are left alone.
    pub fn design_row(&self, range_m: f64, row: &mut [f64]) {
        let basis = Legendre::on_span(self.range_span_m, range_m);
        let places = row.iter_mut().take(self.coefficients.len());
        places.zip(&basis.value[1..]).for_each(|(place, value)| *place = *value);
    }

    /// No value of the polynomial is larger, metre.
    pub fn bound(&self) -> f64 {
        self.coefficients.iter().map(|q| q.abs()).sum()
    }

    /// No derivative with respect to the range is larger: `|P'| ≤ k (k + 1) / 2`.
    pub(crate) fn slope_bound(&self) -> f64 {
        let [low, high] = self.range_span_m;
        let steepest = |order: usize| (order * (order + 1)) as f64 / (high - low);
        self.coefficients.iter().enumerate().map(|(index, q)| q.abs() * steepest(index + 1)).sum()
    }

    /// Refuses an order outside [`Self::ORDERS`], a bad span and coefficients that are not finite.
    pub fn validate(&self) -> Result<()> {
        require_count("polynomial order", self.coefficients.len(), Self::ORDERS)?;
        require_span("polynomial range_span_m", self.range_span_m)?;
        self.coefficients.iter().try_for_each(|value| require_finite("polynomial coefficient", *value))
    }
}
