//! Block means as observations of an adjustment.

use std::sync::{Arc, Mutex, PoisonError};

use adjust::{BlockId, EvaluationFailure, Jacobians, Observation};

use crate::estimate::search::response::{Response, Source, Term};
use crate::estimate::search::scene::Row;

/// The scattered light of one scene at the parameters asked for last: all of its blocks need the same.
pub(in crate::estimate) struct SharedResponse<'s> {
    source: &'s Source,
    largest_sigma: f64,
    state: Mutex<Option<(Vec<f64>, Arc<Response>)>>,
}

/// Smallest width that is estimated, pixels: what is narrower than a pixel is no scattering.
pub(in crate::estimate) const SMALLEST_SIGMA: f64 = 1.0;

/// Terms from parameters: weight, then ln of one width or of two.
pub(in crate::estimate) fn term_from(parameters: &[f64]) -> Option<Term> {
    match *parameters {
        [weight, width] => Some(Term { weight, sigma_px: [width.exp(); 2] }),
        [weight, across, down] => Some(Term { weight, sigma_px: [across.exp(), down.exp()] }),
        _ => None,
    }
}

impl<'s> SharedResponse<'s> {
    pub(in crate::estimate) fn new(source: &'s Source, largest_sigma: f64) -> Self {
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
pub(in crate::estimate) struct BlockObservation<'s> {
    pub(in crate::estimate) shared: &'s SharedResponse<'s>,
    pub(in crate::estimate) rows: &'s [Row],
    pub(in crate::estimate) block: [usize; 2],
    /// Terms first, then the nuisances.
    pub(in crate::estimate) ids: &'s [BlockId],
    pub(in crate::estimate) terms: usize,
    /// Which coefficients belong to each nuisance.
    pub(in crate::estimate) nuisances: &'s [fn(&Row) -> [f64; 2]],
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use adjust::{Adjustment, ParameterBlock, check_jacobian};

    use super::*;
    use crate::estimate::search::response::{INSIDE, OUTSIDE};
    use crate::estimate::views::blocks::Blocks;

    #[test]
    fn the_jacobian_is_that_of_differences() {
        let size = [30, 24];
        let shares: Vec<_> = (0..720).map(|i| if i % 30 < 9 && i / 30 > 12 { INSIDE } else { OUTSIDE }).collect();
        let light: Vec<f64> = (0..720).map(|i| 500.0 + f64::from(i * 31 % 67)).collect();
        let source = Source::new(Blocks::new(size, Some(3)), &light, &light, &shares).unwrap();
        let shared = SharedResponse::new(&source, 60.0);
        let row = |light| Row { observed: 3.0, light, drift: [40.0, -7.0], constant: [0.3, 0.8] };
        let rows = [row([1.0, 0.2]), row([-0.4, 0.7])];
        let nuisances: [fn(&Row) -> [f64; 2]; 2] = [|row| row.drift, |row| row.constant];
        let widths = [2.0_f64.ln(), 9.0_f64.ln(), 6.0_f64.ln()];
        for terms in [vec![vec![0.06, widths[0]], vec![0.03, widths[1]]], vec![vec![0.06, widths[1], widths[2]]]] {
            let values = terms.iter().cloned().chain([vec![0.01, 0.02], vec![0.5, 0.1]]);
            let blocks: Vec<ParameterBlock> = values.map(ParameterBlock::euclidean).collect();
            let mut network = Adjustment::new();
            let ids: Vec<BlockId> = blocks.iter().map(|block| network.add_block(block.clone())).collect();
            let observation = BlockObservation {
                shared: &shared,
                rows: &rows,
                block: [4, 5],
                ids: &ids,
                terms: terms.len(),
                nuisances: &nuisances,
            };
            // Differences of smooth functions of some tens, with steps of 1e-5 or so.
            let check = check_jacobian(&observation, &blocks).unwrap();
            assert!(check.worst < 1e-6, "{check:?}");
        }
    }

    #[test]
    fn widths_out_of_bounds_have_no_value() {
        let source = Source::new(Blocks::new([6, 4], Some(2)), &[1.0; 24], &[1.0; 24], &[INSIDE; 24]).unwrap();
        let shared = SharedResponse::new(&source, 12.0);
        for width in [0.5_f64, 13.0, f64::NAN] {
            assert!(shared.at(&[&[0.1, width.ln()]], false).is_err());
        }
        assert!(shared.at(&[&[0.1, 3.0_f64.ln()]], true).is_ok());
        assert!(shared.at(&[&[0.1]], false).is_err());
    }
}
