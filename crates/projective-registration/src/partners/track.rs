//! A pose on its way to the target, and the steps it takes.

use nalgebra::{Isometry3, Matrix6, UnitQuaternion, Vector3, Vector6};

use crate::error::{Error, Result};
use crate::partners::pairs::{Moved, Rules};
use crate::partners::sums::Normal;
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
    /// Projection on the motions that are held.
    pub held: Matrix6<f64>,
    /// The step that led here, `[dt, rho w]`, and its length in standard deviations.
    pub last_step: Vector6<f64>,
    pub over_sigma: f64,
}

/// About which point, and in which unit, motions are solved.
#[derive(Clone, Copy)]
pub(crate) struct Gauge {
    pub centre: Vector3<f64>,
    pub radius_m: f64,
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

pub(crate) fn moved<'a>(track: &Track, source: &'a OrganisedFrame, target: &'a OrganisedFrame) -> (Moved<'a>, Gauge) {
    let centre = (track.pose * nalgebra::Point3::from(source.points.centre)).coords;
    let gauge = Gauge { centre, radius_m: source.points.radius_m.max(f64::MIN_POSITIVE) };
    (Moved::new(source, target, &track.pose, &gauge.centre, gauge.radius_m), gauge)
}

/// Step `[dt, rho w]` that lowers the residuals, without motions that are held. `ridge`: share of the largest
/// information that is added to all, so that what hardly matters does not run away while the frames are still apart.
pub(crate) fn solve(normal: &Normal, held: &Matrix6<f64>, ridge: f64) -> Result<Vector6<f64>> {
    let free = Matrix6::identity() - held;
    let largest = normal.matrix.diagonal().max();
    let matrix = free * normal.matrix * free + held * largest + Matrix6::identity() * (ridge.max(1e-9) * largest);
    let gradient = free * normal.gradient;
    let cholesky = matrix
        .cholesky()
        .ok_or(Error::Numerical { what: "the normal equations", why: "they are not positive definite" })?;
    Ok(free * -cholesky.solve(&gradient))
}

/// The pose after a motion `[dt, rho w]` about the centre, target axes.
pub(crate) fn turned(pose: &Isometry3<f64>, step: &Vector6<f64>, gauge: &Gauge) -> Isometry3<f64> {
    let shift = Vector3::new(step[0], step[1], step[2]);
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(step[3], step[4], step[5]) / gauge.radius_m);
    let mut rotation = turn * pose.rotation;
    rotation.renormalize();
    let translation = turn * (pose.translation.vector - gauge.centre) + gauge.centre + shift;
    Isometry3::from_parts(translation.into(), rotation)
}
