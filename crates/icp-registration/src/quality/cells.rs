//! What pairs contribute, summed over cells of space.

use std::collections::BTreeMap;

use nalgebra::{Matrix6, Vector3, Vector6};

use rigid_pose::Centred;

/// Degrees of freedom that the mean of Hotelling's T² of six unknowns falls short of.
const LOST_DEGREES: f64 = 7.0;

#[derive(Default)]
pub(super) struct Cell {
    pub score: Vector6<f64>,
    pub information: Matrix6<f64>,
}

/// Sums of scores and information over cubes of space.
pub(crate) struct Cells {
    pub(super) frame: Centred,
    cell_m: f64,
    sums: BTreeMap<[i64; 3], Cell>,
}

impl Cells {
    /// Cells across the rms radius of the pairs: what errs together is smaller than that, and forty cells and more tell six unknowns.
    pub const PER_RADIUS: f64 = 8.0;

    /// No pairs yet; those in a cube of `cell_m` will count as one observation.
    pub fn new(frame: Centred, cell_m: f64) -> Self {
        Self { frame, cell_m, sums: BTreeMap::new() }
    }

    /// Adds a pair at `place` (target frame) with its score, weight times derivative times residual. Returned is what its
    /// information is to be added to: slope of the influence times the cross product of the derivatives along both
    /// normals.
    #[inline]
    pub fn add(&mut self, place: &Vector3<f64>, score: &Vector6<f64>) -> &mut Matrix6<f64> {
        let cell: [f64; 3] = ((place - self.frame.centre) / self.cell_m).into();
        let cell = self.sums.entry(cell.map(|v| v.floor() as i64)).or_default();
        cell.score += score;
        &mut cell.information
    }

    pub(super) fn information(&self) -> Matrix6<f64> {
        self.sums.values().fold(Matrix6::zeros(), |sum, c| sum + c.information)
    }

    /// Root of the sum of squares of what the cells say along a unit motion.
    pub(super) fn scatter(&self, motion: &Vector6<f64>) -> f64 {
        self.sums.values().map(|c| motion.dot(&(c.information * motion)).powi(2)).sum::<f64>().sqrt()
    }

    /// Covariance of the summed score from the scatter of its sums over cells (`inverse`: of the information), and the
    /// factor by which it is to be enlarged.
    ///
    /// The pose follows the errors of every cell in part, so that its residuals are too small by its leverage `H`; `(I −
    /// H)^(-1/2)` gives that back `[BellMcCaffrey2002]`. And few near cells decide most of a pose: a covariance from the
    /// scatter of so few is at times much too small. Enlarged by their degrees of freedom, the normalised square of an
    /// error has the expectation that a known covariance would give it (Hotelling's T²).
    pub(super) fn clustered_scores(&self, inverse: &Matrix6<f64>) -> (Matrix6<f64>, f64) {
        let (mut trace, mut squares) = (0.0, 0.0);
        let sum = self.sums.values().fold(Matrix6::zeros(), |sum, cell| {
            let leverage = cell.information * inverse;
            trace += leverage.trace();
            squares += (leverage * leverage).trace();
            let score = freed(&leverage, &cell.score);
            sum + score * score.transpose()
        });
        // As many equal cells would have these leverages. NaN (nothing is determined) gives the least.
        let degrees = (trace / squares).max(LOST_DEGREES + 1.0);
        (sum, degrees / (degrees - LOST_DEGREES))
    }
}

/// `(I − H)^(-1/2) s` as a series, which stays bounded where one cell decides alone.
fn freed(leverage: &Matrix6<f64>, score: &Vector6<f64>) -> Vector6<f64> {
    let third = leverage * score * (5.0 / 16.0);
    let second = leverage * (score * (3.0 / 8.0) + third);
    score + leverage * (score * 0.5 + second)
}
