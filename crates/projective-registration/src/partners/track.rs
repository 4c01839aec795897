//! A pose on its way to the target, and the steps it takes.

use nalgebra::{Isometry3, Matrix6, Vector6};
use rigid_pose::Centred;

use crate::partners::pairs::{Moved, Rules};
use crate::preparation::blocks::{Block, Points};
use crate::preparation::frame::OrganisedFrame;
use crate::preparation::grid::STRIDES;

/// Fewest points of a level.
const FEWEST_POINTS: usize = 200;

/// The level of all nodes.
pub(crate) const LAST_LEVEL: usize = STRIDES.len() - 1;

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

/// The frame that is moved, and the one that it is moved onto.
#[derive(Clone, Copy)]
pub(crate) struct Frames<'a> {
    pub source: &'a OrganisedFrame,
    pub target: &'a OrganisedFrame,
    /// Points of the source that take part.
    pub points: &'a Points,
}

impl<'a> Frames<'a> {
    pub(crate) fn new(source: &'a OrganisedFrame, target: &'a OrganisedFrame) -> Self {
        Self { source, target, points: &source.points }
    }

    /// Of the source, metre: the unit of lengths.
    pub(crate) fn radius_m(self) -> f64 {
        self.points.radius_m
    }

    /// The blocks of a level.
    pub(crate) fn blocks(self, level: usize) -> &'a [Block] {
        &self.points.blocks[..self.source.grid.levels[level]]
    }

    pub(crate) fn all_blocks(self) -> &'a [Block] {
        &self.points.blocks
    }

    /// The first level that is passed: one with enough nodes, or the last.
    pub(crate) fn first_level(self) -> usize {
        (0..LAST_LEVEL).find(|level| self.points.counts[*level] >= FEWEST_POINTS).unwrap_or(LAST_LEVEL)
    }

    /// A quarter of the nodes, where these are enough.
    pub(crate) fn finest_part(self) -> &'a [Block] {
        let part = LAST_LEVEL - 1;
        if self.points.counts[part] >= FEWEST_POINTS { self.blocks(part) } else { self.all_blocks() }
    }

    /// The source where a track has it, and about what its motions are.
    pub(crate) fn moved(self, track: &Track) -> (Moved<'a>, Centred) {
        let frame = self.source.centred(&track.pose);
        let moved = Moved::new(self.source, self.target, &track.pose, &frame.centre, frame.radius_m);
        (moved.by(track.rules), frame)
    }
}

/// Whether a step is shorter than a tenth of its standard deviation: pairs that change back and forth.
pub(crate) fn is_within_noise(step: &Vector6<f64>, covariance: &Matrix6<f64>) -> bool {
    covariance.cholesky().is_some_and(|c| step.dot(&c.solve(step)) < 0.01)
}
