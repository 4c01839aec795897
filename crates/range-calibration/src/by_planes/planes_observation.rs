//! All pixels of one capture as one observation.

use std::ops::Range;

use adjust::{BlockId, EvaluationFailure, Jacobians, Observation, RigidPose};
use nalgebra::{Isometry3, Vector3};
use rayon::prelude::*;

use crate::by_planes::planes_geometry::{PlaneChart, RangeToPlane};
use crate::by_planes::planes_pixels::PlanePixels;
use crate::by_planes::planes_reduction::{NormalEquations, Reduction};

/// Pixels summed by one thread; always the same, so that the sums are.
const RUN: usize = 16_384;

/// Standard deviations up to which a residual has its full weight in the first, robust stage `[Huber1981]`.
const HUBER: f64 = 1.345;

/// How residuals are weighted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Weighting {
    /// All alike.
    LeastSquares,
    /// Large ones as their absolute values.
    Huber,
}

impl Weighting {
    /// Weight of a residual in standard deviations, and its share of what is to become least.
    fn of(self, residual: f64) -> (f64, f64) {
        let size = residual.abs();
        match self {
            Self::Huber if size > HUBER => (HUBER / size, HUBER * (2.0 * size - HUBER)),
            _ => (1.0, size * size),
        }
    }
}

/// Eq. 17 with the range terms: `ρ = ρ_ref + Δρ(ρ, x, y)` at each pixel, reduced by [`Reduction`] to one component for each
/// unknown and one for the rest. Blocks: plane, terms, and the pose if it is unknown.
pub(crate) struct PlaneObservation<'a> {
    pub(crate) blocks: Vec<BlockId>,
    /// Number of unknowns of each block.
    pub(crate) sizes: Vec<usize>,
    pub(crate) chart: &'a PlaneChart,
    pub(crate) pixels: &'a PlanePixels,
    /// Pose where that is no block.
    pub(crate) world_from_camera: Isometry3<f64>,
    pub(crate) weighting: Weighting,
}

impl PlaneObservation<'_> {
    /// The pose among the parameters, or that which is held.
    fn pose(&self, parameters: &[&[f64]]) -> Result<Isometry3<f64>, EvaluationFailure> {
        parameters.get(2).map_or(Ok(self.world_from_camera), |values| RigidPose::isometry(values))
    }

    /// All pixels that take part, reduced at these parameters: run by run, summed in the order of the runs.
    pub(crate) fn reduction(&self, parameters: &[&[f64]]) -> Result<Reduction, EvaluationFailure> {
        let (plane, terms) = (parameters[0], parameters[1]);
        let seen = self.chart.seen_from(plane, &self.pose(parameters)?);
        let count = self.pixels.len();
        let runs = (0..count.div_ceil(RUN)).into_par_iter();
        let parts = runs.map(|run| self.normal_equations(run * RUN..count.min((run + 1) * RUN), &seen, terms));
        let mut normal = NormalEquations::new(self.columns());
        for part in parts.collect::<Vec<_>>() {
            normal.add_all(part?);
        }
        Ok(normal.reduce())
    }

    /// Normal equations of a run of pixels.
    fn normal_equations(
        &self,
        run: Range<usize>,
        seen: impl Fn(&Vector3<f64>) -> Option<RangeToPlane>,
        terms: &[f64],
    ) -> Result<NormalEquations, EvaluationFailure> {
        let mut normal = NormalEquations::new(self.columns());
        let of_pose = self.sizes.get(2).copied().unwrap_or_default();
        for pixel in run.filter(|pixel| self.pixels.used[*pixel]) {
            let reference = seen(&self.pixels.rays[pixel]);
            let reference = reference.ok_or_else(|| EvaluationFailure::new("a pixel does not see the plane"))?;
            let root = self.pixels.roots_of_weight[pixel];
            let by_pose = reference.by_pose.into_iter().take(of_pose);
            let derivatives = reference.by_plane.into_iter().chain(self.pixels.row(pixel)).chain(by_pose);
            let residual = self.pixels.left_over(pixel, reference.range_m, terms);
            let (weight, objective) = self.weighting.of(root * residual);
            normal.add(derivatives, residual, root * weight.sqrt(), objective);
        }
        Ok(normal)
    }

    fn columns(&self) -> usize {
        self.sizes.iter().sum()
    }
}

impl Observation for PlaneObservation<'_> {
    fn dimension(&self) -> usize {
        self.columns() + 1
    }

    fn blocks(&self) -> &[BlockId] {
        &self.blocks
    }

    fn evaluate(
        &self,
        parameters: &[&[f64]],
        residual: &mut [f64],
        jacobians: Option<&mut Jacobians<'_>>,
    ) -> Result<(), EvaluationFailure> {
        self.reduction(parameters)?.write(&self.sizes, residual, jacobians);
        Ok(())
    }
}
