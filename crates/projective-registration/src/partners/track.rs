//! A pose on its way to the target, and the steps it takes.

use nalgebra::{Isometry3, Matrix6, Vector6};
use rigid_pose::Centred;

use crate::partners::pairs::{Moved, Rules};
use crate::preparation::blocks::Block;
use crate::preparation::frame::OrganisedFrame;
use crate::preparation::grid::STRIDES;

/// Fewest points of a level.
pub(crate) const FEWEST_POINTS: usize = 200;

/// A pose on its way.
#[derive(Clone)]
pub(crate) struct Track {
    pub pose: Isometry3<f64>,
    pub iterations: usize,
    pub rules: Rules,
    /// Projection on the motions that are not held.
    pub free: Matrix6<f64>,
    /// The step that led here, `[dt, rho w]`, and its length in standard deviations.
    pub last_step: Vector6<f64>,
    pub over_sigma: f64,
}

/// The blocks of a level.
pub(crate) fn blocks(source: &OrganisedFrame, level: usize) -> &[Block] {
    &source.points.blocks[..source.grid.levels[level]]
}

/// A quarter of the nodes, where these are enough.
pub(crate) fn finest_part(source: &OrganisedFrame) -> &[Block] {
    let part = STRIDES.len() - 2;
    if source.points.counts[part] >= FEWEST_POINTS { blocks(source, part) } else { &source.points.blocks }
}

/// Whether a step is shorter than a tenth of its standard deviation: pairs that change back and forth.
pub(crate) fn is_within_noise(step: &Vector6<f64>, covariance: &Matrix6<f64>) -> bool {
    covariance.cholesky().is_some_and(|c| step.dot(&c.solve(step)) < 0.01)
}

pub(crate) fn moved<'a>(track: &Track, source: &'a OrganisedFrame, target: &'a OrganisedFrame) -> (Moved<'a>, Centred) {
    let centre = (track.pose * nalgebra::Point3::from(source.points.centre)).coords;
    let frame = Centred { centre, radius_m: source.points.radius_m.max(f64::MIN_POSITIVE) };
    (Moved::new(source, target, &track.pose, &frame.centre, frame.radius_m), frame)
}
