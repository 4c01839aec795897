//! By how much frames disagree about a surface beyond what is stated of them.
//!
//! The heights h that k frames see at a place have the covariance `S = diag(1/w) + R C Rᵀ`, R being their derivatives by the common
//! errors. Where what is stated is true, their squares about their mean, `hᵀ S⁻¹ h - (1ᵀ S⁻¹ h)² / 1ᵀ S⁻¹ 1`, are chi-squared with
//! k - 1 degrees of freedom. The squares of the places around over their degrees of freedom are the variance factor of the adjustment, as far
//! as it is seen from there: what no source tells (a sensor that errs by its depth, by the slant of a surface, in steps) is not alike
//! everywhere.

use nalgebra::DMatrix;
use point_uncertainty::CommonErrors;
use rayon::prelude::*;
use statistics::Distribution;

use super::rows::{Row, form};
use crate::lattice::{Runs, neighbour, neighbours};
use crate::patches::{ONE_SURFACE, largest_sum};
use crate::surfels::{Estimate, Gathered};
use crate::{Error, Result};

/// Cells on each side whose places are asked together. With six, fused points of a Kinect scatter by 0.73 to 1.13 of their sigma, with three by 0.75 to
/// 1.17; more mix what is not alike.
const REACH: i64 = 3;
/// Probability that places which err as stated are said to err by more.
const LEVEL: f64 = 1e-3;

/// Squares of the heights of a place's frames about their mean, and their degrees of freedom.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Squares {
    sum: f64,
    dof: f64,
}

impl Squares {
    pub fn new(place: &Estimate, rows: &[Row], common: &CommonErrors) -> Result<Self> {
        let frames = rows.len();
        if frames < 2 {
            return Ok(Self::default());
        }
        let mut covariance = DMatrix::zeros(frames, frames);
        for (at, (frame, row)) in place.frames.iter().zip(rows).enumerate() {
            for (other, with) in rows[..=at].iter().enumerate() {
                let both = form(row, with, common.covariance());
                (covariance[(at, other)], covariance[(other, at)]) = (both, both);
            }
            covariance[(at, at)] += 1.0 / frame.normal[(0, 0)];
        }
        if !dense_matrices::cholesky(covariance.as_mut_slice(), frames) {
            return Err(Error::Decomposition);
        }
        let height = |frame: &crate::surfels::FrameSums| {
            (frame.right[0] - frame.normal.row(0).transpose().dot(&place.solution)) / frame.normal[(0, 0)]
        };
        let heights: Vec<f64> = place.frames.iter().map(height).collect();
        let (mut of_heights, mut of_ones) = (heights.clone(), vec![1.0; frames]);
        dense_matrices::solve_cholesky(covariance.as_slice(), frames, &mut of_heights, 1);
        dense_matrices::solve_cholesky(covariance.as_slice(), frames, &mut of_ones, 1);
        let squares: f64 = heights.iter().zip(&of_heights).map(|(height, weighted)| height * weighted).sum();
        let (along, weight): (f64, f64) = (of_heights.iter().sum(), of_ones.iter().sum());
        Ok(Self { sum: squares - along * along / weight, dof: frames as f64 - 1.0 })
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
            let (sum, dof) = same.fold((0.0, 0.0), |(sum, dof), at| (sum + squares[at].sum, dof + squares[at].dof));
            if dof > 0.0 && sum > largest_sum(dof, deviations) { sum / dof } else { 1.0 }
        })
        .collect()
}
