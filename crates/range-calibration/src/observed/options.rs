//! What is estimated and what is held.

use adjust::{Adjustment, BlockId, ParameterBlock};
use error_models::{
    AmplitudeHyperbola, FurtherShape, FurtherTerms, PolynomialShape, RangeErrorModel, RangeTerms, SurfaceShape,
};

use crate::{Error, Result};

/// What happens to one of the range terms.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum TermUse {
    /// It is estimated.
    #[default]
    Estimate,
    /// It is held at this value.
    Hold(f64),
}

/// What happens to the amplitude hyperbola (Eq. 15).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum HyperbolaUse {
    /// There is none.
    #[default]
    None,
    /// It is held; differences whose amplitude it does not cover are refused.
    Hold(AmplitudeHyperbola),
    /// h1, h2, h3 are estimated; the span is that of the amplitudes given.
    Estimate,
}

/// Options of [`estimate_range_terms`](crate::estimate_range_terms). Default: d0, d2..d7, e1, e2 estimated, no
/// hyperbola, no further terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeTermOptions {
    /// In the order of [`RangeTerms::NAMES`]: d0, d2..d7, e1, e2. Those that a spline or a surface stands instead of
    /// are not there, whatever they say, but must not be held at a value. Default: all are estimated.
    pub terms: [TermUse; 9],
    /// Eq. 15. Default: [`HyperbolaUse::None`].
    pub hyperbola: HyperbolaUse,
    /// Spline, polynomial and surface; all their coefficients are estimated. Default: that of [`FurtherShape`].
    pub further: FurtherShape,
    /// A combination of parameters is refused as not determined if sharing its effect makes its deviation so many
    /// times larger: what is not in the model grows by that factor as well. Default 100.
    pub largest_inflation: f64,
}

impl Default for RangeTermOptions {
    fn default() -> Self {
        Self {
            terms: [TermUse::Estimate; 9],
            hyperbola: HyperbolaUse::None,
            further: FurtherShape::default(),
            largest_inflation: 100.0,
        }
    }
}

impl RangeTermOptions {
    /// Holds a term by its canonical name.
    pub fn hold(mut self, name: &str, value: f64) -> Result<Self> {
        let index = RangeTerms::NAMES.iter().position(|known| *known == name);
        let index = index.ok_or_else(|| {
            let known = RangeTerms::NAMES.join(", ");
            Error::Model(error_models::Error::UnknownParameter { name: name.into(), known })
        })?;
        self.terms[index] = TermUse::Hold(value);
        Ok(self)
    }

    /// Holds all of d0..e2 at known values, to estimate the hyperbola from what they leave over.
    #[must_use]
    pub fn hold_terms(mut self, terms: &RangeTerms) -> Self {
        self.terms = terms.to_array().map(TermUse::Hold);
        self
    }

    /// Estimates the hyperbola as well.
    #[must_use]
    pub fn with_hyperbola(mut self) -> Self {
        self.hyperbola = HyperbolaUse::Estimate;
        self
    }

    /// A periodic spline with this number of knots, instead of the sines.
    #[must_use]
    pub fn with_spline(mut self, knots: usize) -> Self {
        self.further.spline_knots = Some(knots);
        self
    }

    /// A polynomial in range.
    #[must_use]
    pub fn with_polynomial(mut self, shape: PolynomialShape) -> Self {
        self.further.polynomial = Some(shape);
        self
    }

    /// A surface over the image, instead of e1 and e2.
    #[must_use]
    pub fn with_surface(mut self, shape: SurfaceShape) -> Self {
        self.further.surface = Some(shape);
        self
    }

    pub(crate) fn validate(&self) -> Result<()> {
        if let HyperbolaUse::Hold(hyperbola) = self.hyperbola {
            hyperbola.validate()?;
        }
        if self.largest_inflation >= 1.0 {
            return Ok(());
        }
        Err(Error::OutOfDomain {
            name: "largest_inflation",
            value: self.largest_inflation,
            expected: "an inflation is at least 1",
        })
    }
}

/// The terms that `Δρ` is linear in, as options ask for them.
#[derive(Debug, Clone)]
pub(crate) struct LinearTerms {
    /// Held values; zero, the start value, where a term is estimated.
    pub(crate) model: RangeErrorModel,
    /// For each parameter of the model, whether it is held.
    pub(crate) held: Vec<bool>,
}

impl LinearTerms {
    pub(crate) fn new(options: &RangeTermOptions, ambiguity_interval_m: f64) -> Result<Self> {
        let start = options.terms.map(|term| if let TermUse::Hold(value) = term { value } else { 0.0 });
        let model = RangeErrorModel {
            terms: RangeTerms::from_array(start),
            further: FurtherTerms::zero(&options.further)?,
            ..RangeErrorModel::error_free(ambiguity_interval_m)
        };
        // A value held of what is not there is found here.
        model.validate()?;
        let uses = RangeTerms::NAMES.into_iter().zip(options.terms);
        let held_names: Vec<_> = uses.filter(|(_, term)| *term != TermUse::Estimate).map(|(name, _)| name).collect();
        let held = model.parameter_names().iter().map(|name| held_names.contains(&&**name)).collect();
        Ok(Self { model, held })
    }

    /// Number of unknowns.
    pub(crate) fn unknowns(&self) -> usize {
        self.held.iter().filter(|held| !**held).count()
    }

    /// The parameters as a block of the adjustment, named.
    pub(crate) fn block(&self) -> ParameterBlock {
        let block = ParameterBlock::euclidean(self.model.parameter_values()).named("terms");
        block.with_parameter_names(self.model.parameter_names())
    }

    /// Holds what is held.
    pub(crate) fn hold(&self, adjustment: &mut Adjustment<'_>, block: BlockId) -> Result<()> {
        for (component, _) in self.held.iter().enumerate().filter(|(_, held)| **held) {
            adjustment.hold_parameter(block, component)?;
        }
        Ok(())
    }
}
