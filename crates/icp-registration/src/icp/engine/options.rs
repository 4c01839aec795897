//! What can be chosen in an ICP run.

use std::f64::consts::FRAC_PI_4;

use nalgebra::Matrix6;

use crate::icp::engine::descent::rejections;
use crate::icp::{Alternative, Levels, Registration, Starts};
use crate::kernel::RobustKernel;
use crate::parts::{
    GaussNewton, PlaneToPlane, PointMatching, PointToPlane, PointToPoint, Selection, SigmaWeight, SymmetricPlanes,
};
use crate::quality::FEWEST_PAIRS;
use crate::result::DegeneracyPolicy;
use crate::voxels::VoxelAlignmentOptions;

/// Points of the smaller of two clouds from which on voxels say as much as all points, in a twentieth of the time.
const DENSE: usize = 30_000;

/// What is minimised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Metric {
    /// [`Metric::PointToPlane`]; by [`crate::align`], where no option asks for single points and both clouds hold 30,000 or
    /// more without normals and sigmas, the distance between planes of voxels ([`crate::VoxelCloud`]).
    #[default]
    Automatic,
    /// Distance of the points `[BeslMcKay1992]`. Converges slowly, and sampling of the surface enters the result.
    PointToPoint,
    /// Distance of the source point from the tangent plane of the target `[ChenMedioni1992]`.
    PointToPlane,
    /// Distance along the mean of both normals `[Rusinkiewicz2019]`.
    SymmetricPlanes,
    /// Distance of small disks: generalised ICP `[Segal2009]`.
    PlaneToPlane,
}

/// Options of an ICP run. The defaults carry no scale: distances left at `None` come from the clouds. Pairs whose normals enclose more
/// than 45 degrees are refused (the sign of normals does not count), and fewer than 20 tell no pose: parts may say otherwise
/// ([`Registration`]).
#[derive(Debug, Clone, PartialEq)]
pub struct IcpOptions {
    /// What is minimised. Default: [`Metric::Automatic`].
    pub metric: Metric,
    /// Source points that take part. Default: [`Selection::All`].
    pub selection: Selection,
    /// Largest distance of a pair at the end, metre. `None`, the default: three times the spacing of the target (90 %
    /// quantile).
    pub max_correspondence_distance_m: Option<f64>,
    /// Largest distance of a pair at the start, halved level by level down to the one above. `None`, the default: 2.5
    /// times the median distance at the guess, but at least a quarter of the target's radius and at most all of it.
    pub initial_correspondence_distance_m: Option<f64>,
    /// Robust kernel on the residuals; its scale is their median absolute deviation, anew in each iteration. Default:
    /// [`RobustKernel::Welsch`].
    pub kernel: RobustKernel,
    /// Fraction of the pairs that is kept, those with the smallest distances `[Chetverikov2002]`. Default 1: all.
    pub trim: f64,
    /// Iterations in all levels together. Default 100.
    pub max_iterations: usize,
    /// What happens to undetermined motions. Default: [`DegeneracyPolicy::Report`].
    pub degeneracy: DegeneracyPolicy,
    /// Covariance of the guess in the tangent `[dt target axes (m), dtheta source axes (rad)]`, needed and used only
    /// for [`DegeneracyPolicy::HoldAtPrior`]. Default: `None`.
    pub prior_covariance: Option<Matrix6<f64>>,
    /// A motion counts as undetermined when the predicted standard deviation of points at the cloud's radius exceeds
    /// this, metre. `None`, the default: 1/300 of the radius.
    pub max_motion_sigma_m: Option<f64>,
}

impl Default for IcpOptions {
    fn default() -> Self {
        Self {
            metric: Metric::Automatic,
            selection: Selection::All,
            max_correspondence_distance_m: None,
            initial_correspondence_distance_m: None,
            kernel: RobustKernel::Welsch,
            trim: 1.0,
            max_iterations: 100,
            degeneracy: DegeneracyPolicy::Report,
            prior_covariance: None,
            max_motion_sigma_m: None,
        }
    }
}

impl IcpOptions {
    /// The same by voxels; `None` where an option asks for single points, or there are too few.
    pub(in crate::icp) fn by_voxels(&self, points: usize) -> Option<VoxelAlignmentOptions> {
        let dense = points >= DENSE && self.metric == Metric::Automatic && self.selection == Selection::All;
        let whole = self.trim.to_bits() == 1.0_f64.to_bits();
        let free = self.max_correspondence_distance_m.is_none() && self.degeneracy != DegeneracyPolicy::HoldAtPrior;
        (dense && whole && free).then_some(VoxelAlignmentOptions {
            max_start_error_m: self.initial_correspondence_distance_m,
            kernel: self.kernel,
            max_iterations: self.max_iterations,
            degeneracy: self.degeneracy,
            max_motion_sigma_m: self.max_motion_sigma_m,
        })
    }

    /// The parts that stand for these options.
    pub(in crate::icp) fn with_matching<'a>(&self, matching: impl PointMatching + 'a) -> Registration<'a> {
        let angle = Some(FRAC_PI_4);
        let trim = if self.trim.to_bits() == 1.0_f64.to_bits() { None } else { Some(self.trim) };
        let robust = if self.kernel == RobustKernel::None { RobustKernel::None } else { RobustKernel::Huber };
        let mut alternatives = Alternative::usual(robust, angle, trim);
        if matches!(self.metric, Metric::SymmetricPlanes | Metric::PlaneToPlane) {
            // From afar the target's planes alone draw in farther.
            for alternative in &mut alternatives {
                alternative.metric = Some(Box::new(PointToPlane));
            }
        }
        Registration {
            selection: Box::new(self.selection),
            matching: Box::new(matching),
            rejection: rejections(angle, trim),
            weighting: vec![Box::new(SigmaWeight)],
            metric: match self.metric {
                Metric::PointToPoint => Box::new(PointToPoint),
                Metric::Automatic | Metric::PointToPlane => Box::new(PointToPlane),
                Metric::SymmetricPlanes => Box::new(SymmetricPlanes),
                Metric::PlaneToPlane => Box::new(PlaneToPlane::default()),
            },
            minimisation: Box::new(GaussNewton),
            kernel: self.kernel,
            levels: Levels {
                first_limit_m: self.initial_correspondence_distance_m,
                last_limit_m: self.max_correspondence_distance_m,
                ..Levels::default()
            },
            starts: Some(Starts::default()),
            alternatives,
            max_iterations: self.max_iterations,
            degeneracy: self.degeneracy,
            prior_covariance: self.prior_covariance,
            max_motion_sigma_m: self.max_motion_sigma_m,
            min_correspondences: FEWEST_PAIRS,
        }
    }
}
