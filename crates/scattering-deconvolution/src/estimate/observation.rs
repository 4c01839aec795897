//! Block means as observations of an adjustment.

use std::sync::{Arc, Mutex, PoisonError};

use adjust::{BlockId, EvaluationFailure, Jacobians, Observation};

use super::response::{Response, Source, Term};
use super::scene::Row;

/// The scattered light of one scene at the parameters asked for last: all of its blocks need the same.
pub(super) struct SharedResponse<'s> {
    source: &'s Source,
    largest_sigma: f64,
    state: Mutex<Option<(Vec<f64>, Arc<Response>)>>,
}

/// Smallest width that is estimated, pixels: what is narrower than a pixel is no scattering.
pub(super) const SMALLEST_SIGMA: f64 = 1.0;

/// Terms from parameters: weight, then ln of one width or of two.
pub(super) fn term_from(parameters: &[f64]) -> Option<Term> {
    match *parameters {
        [weight, width] => Some(Term { weight, sigma_px: [width.exp(); 2] }),
        [weight, across, down] => Some(Term { weight, sigma_px: [across.exp(), down.exp()] }),
        _ => None,
    }
}

impl<'s> SharedResponse<'s> {
    pub(super) fn new(source: &'s Source, largest_sigma: f64) -> Self {
        Self { source, largest_sigma, state: Mutex::new(None) }
    }

    /// The response, with derivatives where they are wanted.
    fn at(&self, terms: &[&[f64]], derivatives: bool) -> Result<Arc<Response>, EvaluationFailure> {
        let values = || terms.iter().flat_map(|term| term.iter());
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((known, response)) = &*state {
            let same = known.iter().map(|v| v.to_bits()).eq(values().map(|v| v.to_bits()));
            if same && (!derivatives || terms.is_empty() || !response.derivatives.is_empty()) {
                return Ok(Arc::clone(response));
            }
        }
        let response = Arc::new(self.compute(terms, derivatives)?);
        *state = Some((values().copied().collect(), Arc::clone(&response)));
        Ok(response)
    }

    fn compute(&self, terms: &[&[f64]], derivatives: bool) -> Result<Response, EvaluationFailure> {
        let terms: Option<Vec<Term>> = terms.iter().map(|term| term_from(term)).collect();
        let terms = terms.ok_or_else(|| EvaluationFailure::new("a term needs a weight and one or two widths"))?;
        let allowed = SMALLEST_SIGMA..=self.largest_sigma;
        if terms.iter().any(|term| term.sigma_px.iter().any(|sigma| !allowed.contains(sigma))) {
            return Err(EvaluationFailure::new("a width is below a pixel or far beyond the image"));
        }
        let response = self.source.response(&terms, derivatives);
        response.ok_or_else(|| EvaluationFailure::new("more light is scattered than there is"))
    }
}

/// The mean of one block as an observation of terms, drift and constant.
pub(super) struct BlockObservation<'s> {
    pub(super) shared: &'s SharedResponse<'s>,
    pub(super) rows: &'s [Row],
    pub(super) block: [usize; 2],
    /// Terms first, then the nuisances.
    pub(super) ids: &'s [BlockId],
    pub(super) terms: usize,
    /// Which coefficients belong to each nuisance.
    pub(super) nuisances: &'s [fn(&Row) -> [f64; 2]],
}

impl Observation for BlockObservation<'_> {
    fn dimension(&self) -> usize {
        self.rows.len()
    }

    fn blocks(&self) -> &[BlockId] {
        self.ids
    }

    fn evaluate(
        &self,
        parameters: &[&[f64]],
        residual: &mut [f64],
        jacobians: Option<&mut Jacobians<'_>>,
    ) -> Result<(), EvaluationFailure> {
        let (terms, nuisances) = parameters.split_at(self.terms.min(parameters.len()));
        let response = self.shared.at(terms, jacobians.is_some())?;
        let at = (self.block[0], self.block[1]);
        let light = [response.scattered.real[at], response.scattered.imaginary[at]];
        for (out, row) in residual.iter_mut().zip(self.rows) {
            let others = nuisances.iter().zip(self.nuisances).map(|(values, of)| dot(of(row), values));
            *out = row.observed - dot(row.light, &light) - others.sum::<f64>();
        }
        let Some(jacobians) = jacobians else { return Ok(()) };
        for (index, row) in self.rows.iter().enumerate() {
            for (term, derivatives) in response.derivatives.chunks_exact(3).enumerate() {
                let by = |kind: usize| {
                    let planes = &derivatives[kind];
                    dot(row.light, &[planes.real[at], planes.imaginary[at]])
                };
                match jacobians.row(term, index) {
                    [weight, width] => (*weight, *width) = (by(0), by(1) + by(2)),
                    [weight, across, down] => (*weight, *across, *down) = (by(0), by(1), by(2)),
                    _ => return Err(EvaluationFailure::new("a term needs a weight and one or two widths")),
                }
            }
            for (place, of) in self.nuisances.iter().enumerate() {
                let out = jacobians.row(self.terms + place, index);
                out.iter_mut().zip(of(row)).for_each(|(out, coefficient)| *out = coefficient);
            }
        }
        Ok(())
    }
}

fn dot(coefficients: [f64; 2], values: &[f64]) -> f64 {
    coefficients.iter().zip(values).map(|(a, x)| a * x).sum()
}
