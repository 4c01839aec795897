//! Range terms beyond Eqs. 14 and 15: which there are, and their names.

use crate::{Error, FurtherShape, FurtherTerms, ImageSurface, PeriodicSpline, RangePolynomial, RangeTerms, Result};

impl FurtherTerms {
    /// The terms of a shape, all zero; refuses a bad shape.
    pub fn zero(shape: &FurtherShape) -> Result<Self> {
        Ok(Self {
            spline: shape.spline_knots.map(PeriodicSpline::zero).transpose()?,
            polynomial: shape.polynomial.as_ref().map(RangePolynomial::zero).transpose()?,
            surface: shape.surface.as_ref().map(ImageSurface::zero).transpose()?,
        })
    }

    /// What there is, without its coefficients.
    pub fn shape(&self) -> FurtherShape {
        FurtherShape {
            spline_knots: self.spline.as_ref().map(PeriodicSpline::knots),
            polynomial: self.polynomial.as_ref().map(RangePolynomial::shape),
            surface: self.surface.as_ref().map(ImageSurface::shape),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Refuses bad terms, sines beside a spline and a signal propagation delay beside a surface: the one stands instead
    /// of the other.
    pub(crate) fn validate_beside(&self, terms: &RangeTerms) -> Result<()> {
        if let Some(spline) = &self.spline {
            spline.validate()?;
            require_zero(terms.periodic.iter(), "d2 to d7", "a spline stands instead of the sines, which are zero")?;
        }
        if let Some(surface) = &self.surface {
            surface.validate()?;
            require_zero(
                [terms.e1, terms.e2].iter(),
                "e1, e2",
                "a surface stands instead of e1 and e2, which are zero",
            )?;
        }
        self.polynomial.as_ref().map_or(Ok(()), RangePolynomial::validate)
    }
}

impl FurtherShape {
    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

fn require_zero<'a>(
    mut values: impl Iterator<Item = &'a f64>,
    name: &'static str,
    expected: &'static str,
) -> Result<()> {
    match values.find(|value| **value != 0.0) {
        Some(&value) => Err(Error::OutOfDomain { name, value, expected }),
        None => Ok(()),
    }
}
