//! How much of the misfit between two frames neighbouring pixels share.

use nalgebra::{Isometry3, Matrix6, Vector3, Vector6};

use super::frame::OrganisedFrame;
use super::map::{Partner, Partners};
use super::pairs::with_locate;

/// Cells across the longer side of the frame: those whose sums make the covariance of a registration, and large ones.
const CELLS: [usize; 2] = [24, 6];
/// Residuals beyond this multiple of their standard deviation count as that much.
const REACH: f64 = 3.0;
/// Large cells below which there is no estimate.
const FEWEST: usize = 12;

impl OrganisedFrame {
    /// Factor by which the covariance of a pose grows when errors are taken to be shared over a sixth of the frame
    /// instead of a twenty-fourth, at least 1: that many times larger are the squared sums of the scores of about
    /// `most` nodes of `source` over large cells than those over small ones, on average of the six motions.
    ///
    /// Errors of the sensor that follow it (calibration, disparity steps) show here as far as the two frames see them
    /// at different places; what is alike in both is in no misfit.
    pub(crate) fn shared_error(&self, source: &Self, self_from_source: &Isometry3<f64>, most: usize) -> f64 {
        let grid = &self.projection.grid;
        let sides = CELLS.map(|cells| grid.cols.max(grid.rows).div_ceil(cells).max(1));
        let across = sides.map(|side| grid.cols.div_ceil(side));
        let cells = [0, 1].map(|i| across[i] * grid.rows.div_ceil(sides[i]));
        let mut sums = cells.map(|cells| vec![Vector6::zeros(); cells]);
        let source_from_self = self_from_source.inverse();
        let each = |partner: Option<Partner>| {
            let Some(partner) = partner.filter(Partner::agrees) else { return };
            let score = self.score(&partner, &source_from_self);
            let (row, col) = (partner.node as usize / grid.cols, partner.node as usize % grid.cols);
            for i in 0..2 {
                sums[i][row / sides[i] * across[i] + col / sides[i]] += score;
            }
        };
        let stride = source.stride_for(most);
        with_locate(self, Partners { target: self, source, pose: self_from_source, stride, each });
        let [small, large] = sums.map(|sums| scatter(&sums));
        if large.1 < FEWEST {
            return 1.0;
        }
        let factor = small.0.cholesky().map_or(1.0, |small| small.solve(&large.0).trace() / 6.0);
        if factor.is_finite() { factor.max(1.0) } else { 1.0 }
    }

    /// Derivative of the weighted square of a residual by the tangent `[dt, dtheta]` of the pose, halved.
    fn score(&self, partner: &Partner, source_from_self: &Isometry3<f64>) -> Vector6<f64> {
        let [a, b, c, _] = self.planes[partner.node as usize];
        let normal = Vector3::from([a, b, c].map(f64::from));
        let point = source_from_self * nalgebra::Point3::from(partner.point.map(f64::from));
        let lever = point.coords.cross(&(source_from_self * normal));
        let sigma = f64::from(partner.variance()).sqrt();
        let pull = (f64::from(partner.residual) / sigma).clamp(-REACH, REACH) / sigma;
        Vector6::new(normal.x, normal.y, normal.z, lever.x, lever.y, lever.z) * pull
    }
}

/// Covariance of the sum from the scatter of its parts about nothing, and their number. The pose has taken six of them.
fn scatter(sums: &[Vector6<f64>]) -> (Matrix6<f64>, usize) {
    let used = sums.iter().filter(|sum| **sum != Vector6::zeros()).count();
    let square = sums.iter().fold(Matrix6::zeros(), |square, sum| square + sum * sum.transpose());
    (square * (used as f64 / (used as f64 - 6.0).max(1.0)), used)
}
