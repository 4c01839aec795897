//! The radial and decentring lens that leads best from given points to given points.

use adjust::{Adjustment, Covariance, FunctionObservation, Jacobians, ParameterBlock, SolveOptions};
use nalgebra::{Matrix2, Vector2};

use crate::{LensDistortion, Result};

/// Rounds of new weights after the first fit. Least squares alone sacrifices the few points in the corners; with each
/// round the largest misfit shrinks, and after four it is within a tenth of the least on the calibrations tried.
const ROUNDS: usize = 4;

/// Pixels below which misfits are rounding and no reason for new weights.
const NEGLIGIBLE_PX: f64 = 1e-9;

/// Coefficients fitted, the first of `LensDistortion::NAMES`: k1 to p2. Affinity belongs to the camera matrix.
const TERMS: usize = 5;

/// Least weight of a point relative to the largest, so that none is lost.
const LEAST_WEIGHT: f64 = 1e-6;

/// A point, where the lens should take it (both counted from the principal point), and what a misfit there is in pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair {
    pub(crate) from: Vector2<f64>,
    pub(crate) to: Vector2<f64>,
    pub(crate) pixel_by_misfit: Matrix2<f64>,
}

impl Pair {
    /// Length of the misfit `from - D(from) - to`, pixel.
    pub(crate) fn misfit(&self, lens: &LensDistortion) -> f64 {
        (self.pixel_by_misfit * (self.from - lens.at(self.from) - self.to)).norm()
    }
}

/// The lens without affinity and shear with `from - D(from) = to` for all pairs, the largest misfit being small: least squares in pixels, with
/// weights multiplied by each point's misfit from round to round `[Lawson1961]`.
pub(crate) fn fit_lens(pairs: &[Pair]) -> Result<LensDistortion> {
    let mut weights = vec![1.0; pairs.len()];
    let mut best = least_squares(pairs, &weights)?;
    let mut least = largest_misfit(pairs, &best);
    let mut lens = best;
    for _ in 0..ROUNDS {
        let largest = largest_misfit(pairs, &lens);
        if largest < NEGLIGIBLE_PX {
            break;
        }
        for (weight, pair) in weights.iter_mut().zip(pairs) {
            *weight *= pair.misfit(&lens) / largest;
        }
        let heaviest = weights.iter().copied().fold(0.0, f64::max);
        for weight in &mut weights {
            *weight = (*weight / heaviest).max(LEAST_WEIGHT);
        }
        lens = least_squares(pairs, &weights)?;
        // Not every round is a gain.
        if largest_misfit(pairs, &lens) < least {
            (best, least) = (lens, largest_misfit(pairs, &lens));
        }
    }
    Ok(best)
}

fn largest_misfit(pairs: &[Pair], lens: &LensDistortion) -> f64 {
    pairs.iter().map(|pair| pair.misfit(lens)).fold(0.0, f64::max)
}

/// Weighted least squares of the misfits in pixels; linear in the coefficients.
fn least_squares(pairs: &[Pair], weights: &[f64]) -> Result<LensDistortion> {
    let mut fit = Adjustment::new();
    let block =
        ParameterBlock::euclidean(vec![0.0; TERMS]).with_parameter_names(LensDistortion::NAMES.into_iter().take(TERMS));
    let lens = fit.add_block(block);
    let group = fit.add_group("lens correction");
    for (&Pair { from, to, pixel_by_misfit }, weight) in pairs.iter().zip(weights) {
        let design = pixel_by_misfit * LensDistortion::design(from).fixed_columns::<TERMS>(0);
        let wanted = pixel_by_misfit * (from - to);
        let evaluate = move |parameters: &[&[f64]], residual: &mut [f64], jacobians: Option<&mut Jacobians<'_>>| {
            for (row, residual) in residual.iter_mut().enumerate() {
                let model: f64 = design.row(row).iter().zip(parameters[0]).map(|(a, x)| a * x).sum();
                *residual = wanted[row] - model;
            }
            if let Some(jacobians) = jacobians {
                jacobians.set(0, &design);
            }
            Ok(())
        };
        let sigma = 1.0 / weight.sqrt();
        let observation = FunctionObservation::new([lens], 2, evaluate);
        fit.add_observation(group, observation, &Covariance::from_sigmas(&[sigma, sigma]))?;
    }
    let solution = fit.solve(&SolveOptions::default())?;
    let mut coefficients = [0.0; 7];
    coefficients[..TERMS].copy_from_slice(solution.values(lens)?);
    Ok(LensDistortion::from_coefficients(coefficients))
}
