//! The fit of a curve to block means.

use adjust::{Adjustment, Covariance, EvaluationFailure, FunctionObservation, ParameterBlock, Scale, SolveOptions};
use nalgebra::DMatrix;

use crate::fitting::curve::Curve;
use crate::fitting::projection::Basis;
use crate::fitting::whitening::{Whitening, autocorrelation};
use crate::{DriftError, DriftResult};

/// An adjusted curve.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    /// Constant, amplitude at the first block and ln τ of each transient, coefficient of the temperature, coefficient and
    /// ln τ of what follows the frame rate.
    pub(crate) unknowns: Vec<f64>,
    /// Their covariance matrix, scaled by sigma0².
    pub(crate) covariance: DMatrix<f64>,
    pub(crate) transients: usize,
    /// Whether a part follows the frame rate.
    pub(crate) follows_rate: bool,
    pub(crate) sigma0: f64,
    pub(crate) redundancy: i64,
    /// Observed less modelled, metre.
    pub(crate) residuals_m: Vec<f64>,
}

/// Fits a curve with this number of transients; the start is sought on a grid of time constants.
pub(crate) fn fit(curve: &Curve<'_>, transients: usize, whitening: &Whitening) -> DriftResult<Fit> {
    let time_constants = if transients == 0 { Vec::new() } else { curve.start(transients, whitening) };
    solve(curve, &time_constants, whitening).map_err(|error| shorter(curve, &time_constants, error))
}

/// A fit that fails because its time constant runs away says so.
fn shorter(curve: &Curve<'_>, time_constants: &[f64], error: DriftError) -> DriftError {
    if !error.is_unresolved() {
        return error;
    }
    let rate = curve.rate.map(|rate| curve.require_phase_longer_than(&rate, rate.start_s));
    let longest = time_constants.last().map(|longest| curve.require_longer_than(*longest));
    rate.into_iter().chain(longest).find_map(Result::err).unwrap_or(error)
}

fn solve(curve: &Curve<'_>, time_constants: &[f64], whitening: &Whitening) -> DriftResult<Fit> {
    let transients = time_constants.len();
    let mut network = Adjustment::new();
    let names = (1..=transients).flat_map(|number| [format!("a{number}"), format!("ln tau{number}")]);
    let names = std::iter::once("constant".to_owned()).chain(names);
    let temperature = curve.reference_c.map(|_| "temperature".to_owned());
    let rate = curve.rate.iter().flat_map(|_| ["frame rate".to_owned(), "ln tau of the frame rate".to_owned()]);
    let names = names.chain(temperature).chain(rate);
    let start = linear_start(curve, time_constants, whitening);
    let block = network.add_block(ParameterBlock::euclidean(start).named("drift").with_parameter_names(names));
    let group = network.add_group("block means");
    for index in 0..curve.blocks.len() {
        network.add_observation(group, observation(curve, whitening, block, index), &Covariance::from_sigma(1.0))?;
    }
    // Exponentials hardly above the noise converge slowly, and a millionth of a deviation is nothing.
    let solution = network.solve(&SolveOptions { step_tolerance: 1e-6, ..SolveOptions::default() })?;
    let unknowns = solution.values(block)?.to_vec();
    let modelled = (0..curve.blocks.len()).map(|index| curve.at(index, &unknowns).0);
    let residuals_m = curve.observed().zip(modelled).map(|(observed, modelled)| observed - modelled).collect();
    let redundancy = solution.redundancy();
    let sigma0 = solution.sigma0().ok_or(adjust::Error::NoRedundancy { redundancy })?;
    let covariance = solution.covariance(block, Scale::Posterior)?;
    let follows_rate = curve.rate.is_some();
    Ok(Fit { unknowns, covariance, transients, follows_rate, sigma0, redundancy, residuals_m })
}

/// One whitened block mean.
fn observation<'a>(
    curve: &'a Curve<'_>,
    whitening: &'a Whitening,
    block: adjust::BlockId,
    index: usize,
) -> impl adjust::Observation + 'a {
    FunctionObservation::new([block], 1, move |parameters, residual, jacobians| {
        let unknowns = parameters[0];
        let before = index.saturating_sub(1);
        let (own, other) = (curve.at(index, unknowns), curve.at(before, unknowns));
        let [left, left_before] =
            [(index, own.0), (before, other.0)].map(|(place, value)| curve.blocks[place].change_m - value);
        residual[0] = whitening.one(index, left, left_before);
        if !residual[0].is_finite() {
            return Err(EvaluationFailure::new("a time constant out of all proportion"));
        }
        if let Some(jacobians) = jacobians {
            for (place, out) in jacobians.row(0, 0).iter_mut().enumerate() {
                *out = whitening.one(index, own.1[place], other.1[place]);
            }
        }
        Ok(())
    })
}

/// All unknowns that are linear once the time constants are given.
fn linear_start(curve: &Curve<'_>, time_constants: &[f64], whitening: &Whitening) -> Vec<f64> {
    let rest = curve.without_transients(whitening);
    let exponentials = time_constants.iter().map(|tau| curve.exponential(*tau, whitening));
    let columns: Vec<Vec<f64>> =
        rest[..1].iter().cloned().chain(exponentials).chain(rest[1..].iter().cloned()).collect();
    let design = DMatrix::from_fn(whitening.len(), columns.len(), |row, column| columns[column][row]);
    let observed = nalgebra::DVector::from_vec(whitening.column(curve.observed()));
    // A design without full rank gives some start; the adjustment says what is wrong.
    let linear = design.svd(true, true).solve(&observed, 1e-12);
    let linear = linear.unwrap_or_else(|_| nalgebra::DVector::zeros(columns.len()));
    let mut start = vec![linear[0]];
    start.extend(time_constants.iter().enumerate().flat_map(|(place, tau)| [linear[1 + place], tau.ln()]));
    start.extend(linear.iter().skip(1 + time_constants.len()));
    start.extend(curve.rate.map(|rate| rate.start_s.ln()));
    start
}

impl Fit {
    /// The whitened design at the solution.
    pub(crate) fn basis(&self, curve: &Curve<'_>, whitening: &Whitening) -> Basis {
        let rows: Vec<_> = (0..curve.blocks.len()).map(|index| curve.at(index, &self.unknowns).1).collect();
        Basis::of((0..self.unknowns.len()).map(|column| whitening.column(rows.iter().map(|row| row[column]))))
    }

    /// Correlation of neighbouring residuals.
    pub(crate) fn autocorrelation(&self, curve: &Curve<'_>) -> f64 {
        let standardised = self.residuals_m.iter().zip(curve.blocks).map(|(residual, block)| residual / block.sigma_m);
        autocorrelation(&standardised.collect::<Vec<_>>(), self.unknowns.len())
    }

    /// Amplitude at the first block and time constant of each transient.
    pub(crate) fn transients(&self) -> impl Iterator<Item = (f64, f64)> {
        self.unknowns[1..].chunks_exact(2).take(self.transients).map(|pair| (pair[0], pair[1].exp()))
    }

    /// Coefficient and time constant of what follows the frame rate.
    pub(crate) fn frame_rate(&self) -> Option<(f64, f64)> {
        let pair = self.unknowns.last_chunk::<2>().filter(|_| self.follows_rate)?;
        Some((pair[0], pair[1].exp()))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::DriftBlock;
    use crate::fitting::curve::RateSteps;

    #[test]
    fn the_jacobian_is_that_of_differences() {
        let block = |index: u32| DriftBlock {
            time_s: 300.0 + 60.0 * f64::from(index),
            half_width_s: 30.0,
            change_m: 0.001 * f64::from(index % 7),
            sigma_m: 1e-4 * (1.0 + f64::from(index % 3)),
            temperature_c: Some(30.0 + f64::from(index % 5)),
            samples: 1,
        };
        let blocks: Vec<DriftBlock> = (0..40).map(block).collect();
        // Slow since power-on, fast from a block's edge on, slow again between two blocks.
        let steps = [(0.0, 0.0), (870.0, 4.0), (1700.0, -3.5)];
        let rate = Some(RateSteps { steps: &steps, start_s: 400.0 });
        let curve = Curve { blocks: &blocks, length_s: 60.0, reference_c: Some(33.0), rate };
        let whitening = Whitening::new(&blocks, 60.0, 0.4);
        let unknowns = [0.002, -0.004, 150.0_f64.ln(), 0.003, 900.0_f64.ln(), 2e-4, 3e-3, 400.0_f64.ln()];
        let drift = ParameterBlock::euclidean(unknowns);
        let mut network = Adjustment::new();
        let id = network.add_block(drift.clone());
        for index in [0, 1, 7, 10, 11, 39] {
            let check =
                adjust::check_jacobian(&observation(&curve, &whitening, id, index), std::slice::from_ref(&drift))
                    .unwrap();
            // What the documentation of the check states for a right Jacobian.
            assert!(check.worst < 1e-7, "block {index}: {check:?}");
        }
    }
}
