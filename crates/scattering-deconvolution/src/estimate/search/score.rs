//! Whether one Gaussian more may pay, before it is tried.
//!
//! The score test: to first order, a further Gaussian of small weight reduces the weighted sum of squared residuals r by
//! `(aᵀr)² / aᵀa`, where a is its light after everything that the parameters of the present Gaussians and the nuisances can
//! imitate was taken off.

use nalgebra::{DMatrix, DVector};

use crate::estimate::TermShape;
use crate::estimate::search::fit::{Fit, Problem};
use crate::estimate::search::response::Response;
use crate::estimate::search::start::{Dictionary, Known, design, without_nuisances};
use crate::estimate::views::planes::Planes;

/// Unknowns that a further Gaussian has at least.
const UNKNOWNS: f64 = 2.0;

impl Dictionary {
    /// Whether some further Gaussian promises to reduce the sum of squares by what Schwarz's criterion asks for.
    pub(in crate::estimate) fn promises_more(&self, problem: &Problem<'_>, fit: &Fit) -> bool {
        let limit = problem.scale * problem.options.huber_limit.unwrap_or(f64::INFINITY);
        let present = fit.terms.len() * (1 + problem.options.widths_per_term());
        let widths = self.lights.iter().map(Vec::len).max().unwrap_or(0);
        let size = widths + present;
        let (mut normal, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for (index, scene) in problem.scenes.iter().enumerate() {
            let Ok(source) = &scene.source else { continue };
            let Some(response) = source.response(&fit.terms, true) else { return true };
            let mut lights = self.lights[index].clone();
            lights.extend(derivatives(&response, problem.options.shape));
            let own = fit.agreements.iter().filter(|one| one.scene == index);
            let weights: Vec<f64> = own.map(|one| if one.size > limit { limit / one.size } else { 1.0 }).collect();
            let known = Known { scattered: &response.scattered, weights: &weights };
            let (matrix, residual) = without_nuisances(design(problem, scene, &lights, Some(&known)), lights.len());
            normal += matrix.tr_mul(&matrix);
            right += matrix.tr_mul(&residual);
        }
        let needed = UNKNOWNS * (fit.numbers as f64).ln() * fit.sigma0.powi(2);
        // What cannot be said is tried.
        largest_gain(&normal, &right, widths).is_none_or(|gain| gain.is_nan() || gain > needed)
    }
}

/// Light by parameter of the present Gaussians.
fn derivatives(response: &Response, shape: TermShape) -> Vec<Planes> {
    let mut out = Vec::new();
    for parts in response.derivatives.chunks_exact(3) {
        match shape {
            TermShape::Elliptic => out.extend(parts.iter().cloned()),
            TermShape::Round => {
                let mut width = parts[1].clone();
                width.add(1.0, &parts[2]);
                out.extend([parts[0].clone(), width]);
            }
        }
    }
    out
}

/// Largest reduction by one of the first `widths` columns when all others than these are fitted besides.
fn largest_gain(normal: &DMatrix<f64>, right: &DVector<f64>, widths: usize) -> Option<f64> {
    let present = normal.nrows() - widths;
    let own = normal.view((widths, widths), (present, present)).into_owned();
    let mixed = normal.view((widths, 0), (present, widths)).into_owned();
    let own_right = right.rows(widths, present).into_owned();
    let (reduced, shifted) = if present == 0 {
        (DMatrix::zeros(widths, widths), DVector::zeros(widths))
    } else {
        let factor = own.cholesky()?;
        (mixed.tr_mul(&factor.solve(&mixed)), mixed.tr_mul(&factor.solve(&own_right)))
    };
    let gain = |index: usize| {
        let square = normal[(index, index)] - reduced[(index, index)];
        let product = right[index] - shifted[index];
        // What the present Gaussians imitate to rounding gains nothing.
        if square > 1e-9 * normal[(index, index)] { product * product / square } else { 0.0 }
    };
    (0..widths).map(gain).reduce(f64::max)
}
