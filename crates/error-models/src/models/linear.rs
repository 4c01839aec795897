//! The parameters that the range correction is linear in: names, values and design row, whatever parts are active.

use crate::{Error, FurtherShape, FurtherTerms, RangeErrorModel, RangeTerms, Result};

impl RangeErrorModel {
    /// A model without any error, to set parts of or to estimate from.
    pub fn error_free(ambiguity_interval_m: f64) -> Self {
        Self {
            ambiguity_interval_m,
            terms: RangeTerms::default(),
            hyperbola: None,
            range_span_m: None,
            further: FurtherTerms::default(),
        }
    }

    /// The same model with further terms of this shape, all zero, in place of those it had. Sines give way to a spline,
    /// e1 and e2 to a surface.
    pub fn with_further(mut self, shape: &FurtherShape) -> Result<Self> {
        self.further = FurtherTerms::zero(shape)?;
        if self.further.spline.is_some() {
            self.terms.periodic = [0.0; 6];
        }
        if self.further.surface.is_some() {
            (self.terms.e1, self.terms.e2) = (0.0, 0.0);
        }
        Ok(self)
    }

    /// Names of the parameters that `Δρ` is linear in, in the order of [`Self::design_row`]: `d0`; `d2..d7`, or
    /// `s0..s{n-2}` of a spline with n knots; `e1, e2`, or `g10, g01, g20, ..` of a surface; `q1..` of a polynomial.
    ///
    /// The hyperbola (Eq. 15) is not linear and not among them.
    pub fn parameter_names(&self) -> Vec<String> {
        let [d0, periodic @ .., e1, e2] = RangeTerms::NAMES;
        let mut names = vec![d0.to_owned()];
        match &self.further.spline {
            Some(spline) => names.extend((0..spline.coefficients.len()).map(|knot| format!("s{knot}"))),
            None => names.extend(periodic.map(str::to_owned)),
        }
        match &self.further.surface {
            Some(surface) => {
                let exponents = surface.exponents().zip(&surface.coefficients);
                names.extend(exponents.map(|([i, j], _)| format!("g{i}{j}")));
            }
            None => names.extend([e1, e2].map(str::to_owned)),
        }
        let orders = self.further.polynomial.iter().flat_map(|polynomial| 1..=polynomial.coefficients.len());
        names.extend(orders.map(|order| format!("q{order}")));
        names
    }

    /// Number of parameters that `Δρ` is linear in.
    pub fn parameter_count(&self) -> usize {
        self.part_sizes().iter().sum()
    }

    /// Values of [`Self::parameter_names`].
    pub fn parameter_values(&self) -> Vec<f64> {
        let mut values = vec![self.terms.d0];
        match &self.further.spline {
            Some(spline) => values.extend(&spline.coefficients),
            None => values.extend(self.terms.periodic),
        }
        match &self.further.surface {
            Some(surface) => values.extend(&surface.coefficients),
            None => values.extend([self.terms.e1, self.terms.e2]),
        }
        values.extend(self.further.polynomial.iter().flat_map(|polynomial| &polynomial.coefficients));
        values
    }

    /// Sets the values of [`Self::parameter_names`]; refuses another number of them and values that are not finite, and
    /// leaves the model as it was then. It is not asked whether the model can be inverted: see [`Self::validate`].
    pub fn set_parameter_values(&mut self, values: &[f64]) -> Result<()> {
        self.require_length("parameter values", values.len())?;
        if let Some(&value) = values.iter().find(|value| !value.is_finite()) {
            return Err(Error::OutOfDomain { name: "parameter value", value, expected: "a coefficient is finite" });
        }
        let [_, periodic, position, _] = self.part_sizes();
        self.terms.d0 = values[0];
        let (periodic, rest) = values[1..].split_at(periodic);
        let (position, polynomial) = rest.split_at(position);
        match &mut self.further.spline {
            Some(spline) => spline.coefficients.copy_from_slice(periodic),
            None => self.terms.periodic.copy_from_slice(periodic),
        }
        if let Some(surface) = &mut self.further.surface {
            surface.coefficients.copy_from_slice(position);
        } else {
            (self.terms.e1, self.terms.e2) = (position[0], position[1]);
        }
        if let Some(terms) = &mut self.further.polynomial {
            terms.coefficients.copy_from_slice(polynomial);
        }
        Ok(())
    }

    /// `∂Δρ` by [`Self::parameter_names`] at an observed range (m) and image point from the principal point (mm), into
    /// `row`; its product with [`Self::parameter_values`] is `Δρ` without the hyperbola. Refuses a row of another
    /// length than [`Self::parameter_count`].
    ///
    /// It does not ask whether the range is in the span of the model ([`Self::range_in_span`]); a polynomial and a
    /// surface stay, beyond their spans, as they are at the end.
    pub fn design_row_into(&self, range_m: f64, x_mm: f64, y_mm: f64, row: &mut [f64]) -> Result<()> {
        self.require_length("design row", row.len())?;
        let [_, periodic, position, _] = self.part_sizes();
        row[0] = 1.0;
        let (periodic, rest) = row[1..].split_at_mut(periodic);
        let (position, polynomial) = rest.split_at_mut(position);
        match &self.further.spline {
            Some(spline) => spline.design_row(self.ambiguity_interval_m, range_m, periodic),
            None => periodic.copy_from_slice(&sines(self.ambiguity_interval_m, range_m)),
        }
        match &self.further.surface {
            Some(surface) => surface.design_row(x_mm, y_mm, position),
            None => position.copy_from_slice(&[x_mm, y_mm]),
        }
        if let Some(terms) = &self.further.polynomial {
            terms.design_row(range_m, polynomial);
        }
        Ok(())
    }

    /// [`Self::design_row_into`] into a new row.
    pub fn design_row(&self, range_m: f64, x_mm: f64, y_mm: f64) -> Vec<f64> {
        let mut row = vec![0.0; self.parameter_count()];
        // The row has the right length, the only thing that may be refused.
        let _ = self.design_row_into(range_m, x_mm, y_mm, &mut row);
        row
    }

    fn require_length(&self, name: &'static str, found: usize) -> Result<()> {
        let expected = self.parameter_count();
        if found == expected { Ok(()) } else { Err(Error::WrongLength { name, found, expected }) }
    }

    /// Number of parameters of offset, periodic part, part by position, polynomial.
    fn part_sizes(&self) -> [usize; 4] {
        let FurtherTerms { spline, surface, polynomial } = &self.further;
        [
            1,
            spline.as_ref().map_or(6, |spline| spline.coefficients.len()),
            surface.as_ref().map_or(2, |surface| surface.coefficients.len()),
            polynomial.as_ref().map_or(0, |polynomial| polynomial.coefficients.len()),
        ]
    }
}

/// Columns of d2..d7.
fn sines(ambiguity_interval_m: f64, range_m: f64) -> [f64; 6] {
    let [_, sines @ .., _, _] = RangeTerms::design_row(ambiguity_interval_m, range_m, 0.0, 0.0);
    sines
}
