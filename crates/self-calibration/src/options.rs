//! What is estimated and what is held.

use error_models::{AmplitudeHyperbola, RangeTerms};

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
/// hyperbola.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeTermOptions {
    /// In the order of [`RangeTerms::NAMES`]: d0, d2..d7, e1, e2.
    pub terms: [TermUse; 9],
    /// Eq. 15.
    pub hyperbola: HyperbolaUse,
    /// A combination of parameters is refused as not determined if sharing its effect makes its deviation so many
    /// times larger: what is not in the model grows by that factor as well. Default 100.
    pub largest_inflation: f64,
}

impl Default for RangeTermOptions {
    fn default() -> Self {
        Self { terms: [TermUse::Estimate; 9], hyperbola: HyperbolaUse::None, largest_inflation: 100.0 }
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

    /// Number of unknowns.
    pub(crate) fn unknowns(&self) -> usize {
        let terms = self.terms.iter().filter(|term| **term == TermUse::Estimate).count();
        terms + if self.hyperbola == HyperbolaUse::Estimate { 3 } else { 0 }
    }

    /// Held values; zero, the start value, where a term is estimated.
    pub(crate) fn start(&self) -> [f64; 9] {
        self.terms.map(|term| if let TermUse::Hold(value) = term { value } else { 0.0 })
    }

    pub(crate) fn validate(&self) -> Result<()> {
        RangeTerms::from_array(self.start()).validate()?;
        if let HyperbolaUse::Hold(hyperbola) = self.hyperbola {
            hyperbola.validate()?;
        }
        if self.unknowns() == 0 {
            return Err(Error::NothingToEstimate);
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
