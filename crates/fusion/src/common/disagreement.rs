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

/// Weighted squares of the differences between the heights of a place's frames, and their degrees of freedom.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Squares {
    pub sum: f64,
    pub dof: f64,
    /// Part of the degrees of freedom that belongs to common errors: the trace of `S⁻¹ R C Rᵀ`, both of the differences.
    common: f64,
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
        let sum = heights.iter().zip(&weighted).map(|(height, weighted)| height * weighted).sum();
        // The trace of `S⁻¹` times what is the place's own of the covariance of the differences.
        let inverse = dense_matrices::inverse_of_cholesky(covariance.as_slice(), size);
        let own: f64 = inverse.iter().sum::<f64>() * variance(first)
            + others.iter().enumerate().map(|(at, frame)| inverse[at * size + at] * variance(frame)).sum::<f64>();
        Self { sum, dof: size as f64, common: (size as f64 - own).max(0.0) }
    }
}

/// Squares of places that are asked together.
#[derive(Default)]
struct Together {
    squares: Squares,
    places: f64,
}

impl Together {
    fn add(mut self, of: &Squares) -> Self {
        let Squares { sum, dof, common } = &mut self.squares;
        (*sum, *dof, *common) = (*sum + of.sum, *dof + of.dof, *common + of.common);
        self.places += f64::from(u8::from(of.dof > 0.0));
        self
    }

    /// By how many times they are larger than stated; one where that may be chance. Common errors are the same at all places: the variance
    /// of the sum, 2 dof for independent ones, is larger by twice `Σ tr(Fᵢ Fⱼ)`, i ≠ j, F being the part of the covariance that is
    /// theirs, and so there are fewer squares that are independent (Satterthwaite's approximation).
    fn factor(&self, deviations: f64) -> f64 {
        let Squares { sum, dof, common } = self.squares;
        if dof <= 0.0 {
            return 1.0;
        }
        let independent = dof * dof / (dof + common * common * (self.places - 1.0) / dof);
        if sum / dof * independent > largest_sum(independent, deviations) { sum / dof } else { 1.0 }
    }
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
            same.fold(Together::default(), |together, at| together.add(&squares[at])).factor(deviations)
        })
        .collect()
}
