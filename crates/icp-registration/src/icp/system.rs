//! Residuals, weights and the 6x6 normal equations of one iteration.
//!
//! Motions are `[dt, rho w]`: translation and rotation about the centroid of the pairs in target axes, the rotation
//! multiplied by the rms radius of the pairs. All six are lengths, so that one eigenvalue compares with another.

use nalgebra::{Matrix6, Vector3, Vector6};
use rayon::prelude::*;

use super::Metric;
use super::matching::{CHUNK, Matcher, Pair};
use crate::eigen::eigen6;
use crate::error::Result;
use crate::kernel::mad_scale;
use crate::pose::symmetrised;

/// Median of the length of a vector of three standard normal numbers.
const MEDIAN_CHI3: f64 = 1.538;
/// Eigenvalues below this fraction of the largest are rounding: no step along them.
const RANK_TOLERANCE: f64 = 1e-10;

/// Pairs with their weights, ready to be summed.
pub(crate) struct System<'a> {
    pub matcher: &'a Matcher<'a>,
    pub pairs: &'a [Pair],
    pub centre: Vector3<f64>,
    pub radius_m: f64,
    /// Standard deviation of a whitened residual.
    pub scale: f64,
    /// Standard deviation of each pair as far as it is known beforehand (1 where nothing is known).
    sigma: Vec<f64>,
}

/// A derivative with its residual.
#[derive(Clone, Copy)]
pub(crate) struct Row {
    pub jacobian: Vector6<f64>,
    pub residual: f64,
}

impl<'a> System<'a> {
    pub(crate) fn new(matcher: &'a Matcher<'a>, pairs: &'a [Pair]) -> Self {
        let n = pairs.len().max(1) as f64;
        let centre = pairs.iter().fold(Vector3::zeros(), |sum, p| sum + p.moved) / n;
        let square: f64 = pairs.iter().map(|p| (p.moved - centre).norm_squared()).sum();
        // Pairs all in one place leave the rotation undetermined whatever the radius.
        let radius_m = (square / n).sqrt().max(f64::MIN_POSITIVE.sqrt());
        let sigma = pair_sigma(matcher, pairs);
        let mut system = Self { matcher, pairs, centre, radius_m, scale: 1.0, sigma };
        let mut whitened: Vec<f64> =
            pairs.iter().zip(&system.sigma).map(|(p, s)| system.residual_length(p) / s).collect();
        system.scale = match matcher.options.metric {
            Metric::PointToPlane => mad_scale(&mut whitened),
            Metric::PointToPoint => mad_scale(&mut whitened) / 1.4826 / MEDIAN_CHI3,
        };
        system
    }

    /// The same frame and scale with other pairs: what the score would be had the pose been a little different.
    pub(crate) fn with_pairs(&self, pairs: &'a [Pair]) -> Self {
        let sigma = pair_sigma(self.matcher, pairs);
        let (centre, radius_m, scale) = (self.centre, self.radius_m, self.scale);
        Self { matcher: self.matcher, pairs, centre, radius_m, scale, sigma }
    }

    /// Length that the kernel looks at.
    pub(crate) fn residual_length(&self, pair: &Pair) -> f64 {
        match self.matcher.options.metric {
            Metric::PointToPlane => self.row(pair, &self.matcher.target.normals[pair.target]).residual.abs(),
            Metric::PointToPoint => pair.distance_m,
        }
    }

    /// Residual of a pair along a unit direction of the target frame, with its derivative.
    pub(crate) fn row(&self, pair: &Pair, direction: &Vector3<f64>) -> Row {
        let arm = (pair.moved - self.centre) / self.radius_m;
        let turn = arm.cross(direction);
        let jacobian = Vector6::new(direction.x, direction.y, direction.z, turn.x, turn.y, turn.z);
        let residual = direction.dot(&(pair.moved - self.matcher.target.cloud.points[pair.target].coords));
        Row { jacobian, residual }
    }

    /// The rows of a pair: one along the normal, or three along the axes.
    pub(crate) fn rows(&self, pair: &Pair) -> ([Row; 3], usize) {
        match self.matcher.options.metric {
            Metric::PointToPlane => ([self.row(pair, &self.matcher.target.normals[pair.target]); 3], 1),
            Metric::PointToPoint => ([Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| self.row(pair, &axis)), 3),
        }
    }

    /// Weight of pair `i` and the slope of its influence, both over sigma².
    pub(crate) fn weights(&self, i: usize) -> (f64, f64) {
        let precision = self.sigma[i].powi(-2);
        // Without any scatter every residual is exact (or the kernel would reject all but the zeros).
        if self.scale <= 1e-12 * self.radius_m {
            return (precision, precision);
        }
        let u = self.residual_length(&self.pairs[i]) / (self.sigma[i] * self.scale);
        let kernel = self.matcher.options.kernel;
        (kernel.weight(u) * precision, kernel.influence_slope(u) * precision)
    }

    /// Normal matrix `Σ w J J^T` and right-hand side `Σ w J r`, summed in fixed chunks.
    pub(crate) fn normal_equations(&self) -> (Matrix6<f64>, Vector6<f64>) {
        let indices: Vec<usize> = (0..self.pairs.len()).collect();
        let partial: Vec<(Matrix6<f64>, Vector6<f64>)> = indices
            .par_chunks(CHUNK)
            .map(|chunk| {
                let (mut h, mut g) = (Matrix6::zeros(), Vector6::zeros());
                for &i in chunk {
                    let (weight, _) = self.weights(i);
                    let (rows, count) = self.rows(&self.pairs[i]);
                    for row in &rows[..count] {
                        h.ger(weight, &row.jacobian, &row.jacobian, 1.0);
                        g += row.jacobian * (weight * row.residual);
                    }
                }
                (h, g)
            })
            .collect();
        partial.iter().fold((Matrix6::zeros(), Vector6::zeros()), |(h, g), (dh, dg)| (h + dh, g + dg))
    }

    /// Gauss-Newton step `[dt, rho w]` in the complement of the held directions (orthonormal columns).
    pub(crate) fn step(&self, held: &[Vector6<f64>]) -> Result<Vector6<f64>> {
        let (h, g) = self.normal_equations();
        let mut keep = Matrix6::identity();
        for direction in held {
            keep -= direction * direction.transpose();
        }
        let (values, vectors) = eigen6(&symmetrised(&(keep * h * keep)), "the normal equations of an iteration")?;
        let right = keep * g;
        let mut step = Vector6::zeros();
        for k in 0..6 {
            if values[k] > RANK_TOLERANCE * values[5] && values[k] > 0.0 {
                let v = vectors.column(k);
                step -= v * (v.dot(&right) / values[k]);
            }
        }
        Ok(keep * step)
    }

    /// Root mean square of the residuals of the metric, weighted by the kernel, metre.
    pub(crate) fn rms_m(&self) -> f64 {
        let (mut squares, mut total) = (0.0, 0.0);
        for (i, pair) in self.pairs.iter().enumerate() {
            let weight = self.weights(i).0 * self.sigma[i].powi(2);
            squares += weight * self.residual_length(pair).powi(2);
            total += weight;
        }
        if total > 0.0 { (squares / total).sqrt() } else { f64::NAN }
    }
}

/// Combined sigma of source and target point; where one is unknown, the median of the known.
fn pair_sigma(matcher: &Matcher<'_>, pairs: &[Pair]) -> Vec<f64> {
    let of = |plane: Option<&Vec<f64>>, i: usize| plane.map_or(0.0, |s| s[i].powi(2));
    let (source, target) = (matcher.source.sigma.as_ref(), matcher.target.cloud.sigma.as_ref());
    if source.is_none() && target.is_none() {
        return vec![1.0; pairs.len()];
    }
    let mut sigma: Vec<f64> = pairs.iter().map(|p| (of(source, p.source) + of(target, p.target)).sqrt()).collect();
    let mut known: Vec<f64> = sigma.iter().copied().filter(|s| *s > 0.0).collect();
    let median = if known.is_empty() { 1.0 } else { crate::kernel::quantile(&mut known, 0.5) };
    for value in &mut sigma {
        if value.is_nan() || *value <= 0.0 {
            *value = median;
        }
    }
    sigma
}
