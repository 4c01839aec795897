//! Residuals, weights and the 6x6 normal equations of one iteration.
//!
//! Motions are `[dt, rho w]`: translation and rotation about the centroid of the pairs in target axes, the rotation
//! multiplied by the rms radius of the pairs. All six are lengths, so that one eigenvalue compares with another.

use nalgebra::{Isometry3, UnitQuaternion, Vector6};
use rayon::prelude::*;
use statistics::{CHI_MEDIANS, mad_scale, upper_median};

use crate::kernel::RobustKernel;
use crate::parts::{ErrorMetric, Pair, Row, Rows, Scene};
use rigid_pose::{Centred, MotionEquations};

/// Points, pairs or voxels handled together by one thread; fixed, so that sums do not depend on the number of threads.
pub(crate) const CHUNK: usize = 512;
/// Scale of lengths, in radii, below which they count as exact beside another channel.
const SMALLEST_LENGTH: f64 = 1e-4;

/// The pairs of one iteration with their residuals and weights, ready to be summed.
pub struct System<'a> {
    scene: &'a Scene<'a>,
    metric: &'a dyn ErrorMetric,
    pairs: &'a [Pair],
    kernel: RobustKernel,
    frame: Centred,
    /// Standard deviation of a whitened residual.
    scale: f64,
    /// Factor that brings residuals of channel 1 to metres.
    balance: f64,
    /// Length that the kernel looks at, metre.
    lengths: Vec<f64>,
}

impl<'a> System<'a> {
    pub(crate) fn new(
        scene: &'a Scene<'a>,
        metric: &'a dyn ErrorMetric,
        pairs: &'a [Pair],
        kernel: RobustKernel,
    ) -> Self {
        // Pairs all in one place leave the rotation undetermined whatever the radius.
        let frame = Centred::about(pairs.iter().map(|pair| pair.moved), f64::MIN_POSITIVE.sqrt());
        let mut system = Self { scene, metric, pairs, kernel, frame, scale: 1.0, balance: 1.0, lengths: Vec::new() };
        system.balance = system.balance_of_channels();
        system.lengths = system.all_lengths();
        let mut whitened: Vec<f64> = pairs.iter().zip(&system.lengths).map(|(p, l)| l * p.weight.sqrt()).collect();
        // Without pairs there is no scale.
        let median = upper_median(&mut whitened).max(0.0);
        system.scale = median / CHI_MEDIANS[metric.degrees_of_freedom().clamp(1, 4) - 1];
        system
    }

    /// With motions told in another frame.
    pub(crate) fn in_frame(self, frame: Option<Centred>) -> Self {
        Self { frame: frame.unwrap_or(self.frame), ..self }
    }

    /// The same frame, scale and kernel with other pairs: what the score would be had the pose been a little different.
    pub(crate) fn with_pairs(&self, scene: &'a Scene<'a>, pairs: &'a [Pair]) -> Self {
        let mut system = Self { scene, pairs, lengths: Vec::new(), ..*self };
        system.lengths = system.all_lengths();
        system
    }

    /// The surfaces and the moment.
    pub fn scene(&self) -> &Scene<'a> {
        self.scene
    }

    /// The pairs.
    pub fn pairs(&self) -> &[Pair] {
        self.pairs
    }

    /// Frame of motions: centroid of the moved source points, and their rms distance from it.
    pub fn frame(&self) -> Centred {
        self.frame
    }

    /// The pose after a motion `[dt, rho w]`.
    pub fn moved(&self, motion: &Vector6<f64>) -> Isometry3<f64> {
        self.frame.moved(&self.scene.moment.pose, motion)
    }

    /// Length of the residual of pair `i` that the kernel looks at, metre.
    pub fn residual_length(&self, i: usize) -> f64 {
        self.lengths[i]
    }

    /// The weights of all pairs, kernel included.
    pub fn all_weights(&self) -> Vec<f64> {
        (0..self.pairs.len()).map(|i| self.weights(i).0).collect()
    }

    /// Normal equations, summed in fixed chunks.
    pub fn normal_equations(&self) -> MotionEquations {
        let starts: Vec<usize> = (0..self.pairs.len()).step_by(CHUNK).collect();
        let chunk = |&start: &usize| {
            let mut equations = MotionEquations::default();
            let mut rows = Rows::default();
            for i in start..(start + CHUNK).min(self.pairs.len()) {
                let (pair, weight) = (&self.pairs[i], self.weights(i).0);
                self.rows(pair, &mut rows);
                for (row, residual) in rows.as_slice().iter().zip(self.residuals(&rows)) {
                    equations.add(&self.jacobian(pair, row), weight, residual);
                }
            }
            equations
        };
        starts.par_iter().map(chunk).collect::<Vec<_>>().into_iter().sum()
    }

    /// Weighted sum of squares of the same pairs after a motion.
    pub fn squares_after(&self, motion: &Vector6<f64>, weights: &[f64]) -> f64 {
        let turn = UnitQuaternion::from_scaled_axis(motion.fixed_rows::<3>(3) / self.frame.radius_m);
        let mut rows = Rows::default();
        let squares = self.pairs.iter().zip(weights).map(|(pair, weight)| {
            let moved = self.frame.centre + turn * (pair.moved - self.frame.centre) + motion.fixed_rows::<3>(0);
            let distance_m = (moved - pair.point).norm();
            self.rows(&Pair { moved, source_normal: turn * pair.source_normal, distance_m, ..*pair }, &mut rows);
            weight * self.residuals(&rows).map(|r| r * r).sum::<f64>()
        });
        squares.sum()
    }

    /// Weight of pair `i` and the slope of its influence, both over sigma².
    pub(crate) fn weights(&self, i: usize) -> (f64, f64) {
        let precision = self.pairs[i].weight;
        // Without any scatter every residual is exact (or the kernel would reject all but the zeros).
        if self.scale <= 1e-12 * self.frame.radius_m * precision.sqrt() {
            return (precision, precision);
        }
        let u = self.lengths[i] * precision.sqrt() / self.scale;
        (self.kernel.weight(u) * precision, self.kernel.influence_slope(u) * precision)
    }

    /// Derivative of a row with respect to motions, in metres per metre.
    pub(crate) fn jacobian(&self, pair: &Pair, row: &Row) -> Vector6<f64> {
        let factor = if row.channel == 0 { 1.0 } else { self.balance };
        let g = row.gradient * factor;
        let turn = ((pair.moved - self.frame.centre).cross(&g) + row.turn * factor) / self.frame.radius_m;
        Vector6::new(g.x, g.y, g.z, turn.x, turn.y, turn.z)
    }

    /// Sum of `w J r` over the rows of a pair.
    pub(crate) fn score(&self, i: usize, rows: &mut Rows) -> Vector6<f64> {
        let (pair, weight) = (&self.pairs[i], self.weights(i).0);
        self.rows(pair, rows);
        let terms = rows.as_slice().iter().zip(self.residuals(rows));
        terms.fold(Vector6::zeros(), |sum, (row, r)| sum + self.jacobian(pair, row) * (weight * r))
    }

    /// Whether the metric is the distance of points.
    pub(crate) fn is_point_to_point(&self) -> bool {
        self.metric.is_point_to_point()
    }

    /// Factor on the products of all twins.
    pub(crate) fn twin_weight(&self) -> f64 {
        self.metric.twin_weight(self.scene, self.pairs)
    }

    /// What the metric's own derivatives say in two independent copies.
    pub(crate) fn twins(&self, pair: &Pair, a: &mut Rows, b: &mut Rows) {
        a.clear();
        b.clear();
        self.metric.twins(self.scene, pair, a, b);
    }

    pub(crate) fn rows(&self, pair: &Pair, rows: &mut Rows) {
        rows.clear();
        self.metric.rows(self.scene, pair, rows);
    }

    /// Residuals of rows, metre.
    pub(crate) fn residuals<'r>(&self, rows: &'r Rows) -> impl Iterator<Item = f64> + use<'r> {
        let balance = self.balance;
        rows.as_slice().iter().map(move |row| row.residual * if row.channel == 0 { 1.0 } else { balance })
    }

    /// Root mean square of the residuals of the metric, weighted by the kernel, metre.
    pub(crate) fn rms_m(&self) -> f64 {
        let (mut squares, mut total) = (0.0, 0.0);
        for (i, (pair, length)) in self.pairs.iter().zip(&self.lengths).enumerate() {
            let weight = self.weights(i).0 / pair.weight;
            squares += weight * length * length;
            total += weight;
        }
        if total > 0.0 { (squares / total).sqrt() } else { f64::NAN }
    }

    fn all_lengths(&self) -> Vec<f64> {
        let mut rows = Rows::default();
        let length = |pair: &Pair| {
            self.rows(pair, &mut rows);
            self.residuals(&rows).map(|r| r * r).sum::<f64>().sqrt()
        };
        self.pairs.iter().map(length).collect()
    }

    /// Scale of channel 0 over that of channel 1; 1 where there is only one channel.
    fn balance_of_channels(&self) -> f64 {
        if self.metric.channels() == 1 {
            return 1.0;
        }
        let mut rows = Rows::default();
        let mut channels = [Vec::new(), Vec::new()];
        for pair in self.pairs {
            self.rows(pair, &mut rows);
            for row in rows.as_slice() {
                channels[row.channel.min(1)].push(row.residual.abs() * pair.weight.sqrt());
            }
        }
        let [length, other] = channels.map(|mut residuals| mad_scale(&mut residuals).max(0.0));
        // Exact lengths must not silence the other channel.
        if other > 0.0 { length.max(SMALLEST_LENGTH * self.frame.radius_m) / other } else { 0.0 }
    }
}
