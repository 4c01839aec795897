//! By how much frames disagree about a surface beyond what is stated of them.
//!
//! The heights h that k frames see at a place have the covariance `S = diag(1/w) + R C Rᵀ`, R being their derivatives by the common
//! errors. Where what is stated is true, the squares of their differences, weighted by the inverse of the covariance of these, are
//! chi-squared with k - 1 degrees of freedom. The squares of the places around over their degrees of freedom are the variance factor of the adjustment, as far
//! as it is seen from there: what no source tells (a sensor that errs by its depth, by the slant of a surface, in steps) is not alike
//! everywhere.

use nalgebra::DMatrix;
use point_uncertainty::CommonErrors;
use rayon::prelude::*;
use statistics::Distribution;

use super::rows::{Row, difference, form};
use crate::lattice::{Runs, neighbour, neighbours};
use crate::patches::{ONE_SURFACE, largest_sum};
use crate::surfels::{Estimate, FrameSums, Gathered};

/// Cells on each side whose places are asked together. With six, fused points of a Kinect scatter by 0.73 to 1.13 of their sigma, with
/// three by 0.75 to 1.17; more mix what is not alike.
const REACH: i64 = 3;
/// Probability that places which err as stated are said to err by more.
const LEVEL: f64 = 1e-3;

/// Least factor of the noise of all frames that is believed. Simulated rooms whose noise is as stated have 0.83 to 0.95, and up to 1.32
/// where what is common to frames is not taken off; frames of a Kinect have 1.7 to 2.7.
const NOISIER: f64 = 1.44;

/// Weighted squares of the differences between the heights of a place's frames, and their degrees of freedom.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Squares {
    sum: f64,
    dof: f64,
}

impl Squares {
    /// None where a single frame sees the place, or rounding hides how they differ.
    pub fn new(place: &Estimate, rows: &[Row], common: &CommonErrors) -> Self {
        let (Some((first, others)), Some((first_row, rows))) = (place.frames.split_first(), rows.split_first()) else {
            return Self::default();
        };
        let size = others.len();
        // Against the first frame: what all have in common is gone before anything is squared.
        let by: Vec<Row> = rows.iter().map(|row| difference(row, first_row, 1.0)).collect();
        let variance = |frame: &FrameSums| 1.0 / frame.normal[(0, 0)];
        let mut covariance = DMatrix::from_element(size, size, variance(first));
        for at in 0..size {
            covariance[(at, at)] += variance(&others[at]);
            for other in 0..=at {
                let both = covariance[(at, other)] + form(&by[at], &by[other], common.covariance());
                (covariance[(at, other)], covariance[(other, at)]) = (both, both);
            }
        }
        if !dense_matrices::cholesky(covariance.as_mut_slice(), size) {
            return Self::default();
        }
        let height = |frame: &FrameSums| {
            (frame.right[0] - frame.normal.row(0).transpose().dot(&place.solution)) / frame.normal[(0, 0)]
        };
        let heights: Vec<f64> = others.iter().map(|frame| height(frame) - height(first)).collect();
        let mut weighted = heights.clone();
        dense_matrices::solve_cholesky(covariance.as_slice(), size, &mut weighted, 1);
        Self { sum: heights.iter().zip(&weighted).map(|(height, weighted)| height * weighted).sum(), dof: size as f64 }
    }
}

/// By how many times noise is larger than stated in all frames, in the variance: the weighted median of the squares of places over the
/// median of chi-squared, so that half of the places may be where frames see different things. One below [`NOISIER`].
pub(crate) fn noise_factor(squares: &[Squares]) -> f64 {
    let ratio = |of: &Squares| (of.sum / Distribution::ChiSquared { dof: of.dof }.quantile(0.5), of.dof);
    let mut ratios: Vec<(f64, f64)> = squares.iter().filter(|of| of.dof > 0.0).map(ratio).collect();
    ratios.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let half = 0.5 * ratios.iter().map(|(_, dof)| dof).sum::<f64>();
    let mut below = 0.0;
    let median = ratios.iter().find(|(_, dof)| {
        below += dof;
        below >= half
    });
    median.map(|(ratio, _)| *ratio).filter(|ratio| *ratio > NOISIER).unwrap_or(1.0)
}

/// For each place, by how many times its variance is larger than stated; one where what its frames and those of the places around see
/// fits what is stated.
pub(crate) fn variance_factors(gathered: &Gathered, squares: &[Squares]) -> Vec<f64> {
    let cells = Runs::new(gathered.seeds.iter().map(|(key, _)| *key));
    let around = neighbours(REACH);
    let deviations = Distribution::Normal.upper_quantile(LEVEL);
    (0..squares.len())
        .into_par_iter()
        .with_min_len(64)
        .map(|at| {
            let normal = &gathered.estimates[at].normal;
            let places = around.iter().flat_map(|by| cells.of(neighbour(gathered.seeds[at].0, *by)));
            let same = places.filter(|other| gathered.estimates[*other].normal.dot(normal) > ONE_SURFACE);
            let (sum, dof) = same.fold((0.0, 0.0), |(sum, dof), at| (sum + squares[at].sum, dof + squares[at].dof));
            if dof > 0.0 && sum > largest_sum(dof, deviations) { sum / dof } else { 1.0 }
        })
        .collect()
}
