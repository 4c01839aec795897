//! A registration made of parts, and the loop that runs them.

use nalgebra::{Isometry3, Matrix6, Vector3, Vector6};

use crate::error::{Error, Result};
use crate::icp::IcpOptions;
use crate::icp::engine::descent::{Alternative, Levels};
use crate::icp::engine::matching::Points;
use crate::icp::engine::quality::verdict;
use crate::icp::starts::Starts;
use crate::kernel::RobustKernel;
use crate::parts::{
    ErrorMetric, Minimiser, Moment, NearestPoint, PairRejection, PairWeighting, PointMatching, PointSelection, Scene,
};
use crate::quality::{Free, OPEN, SMALL_STEP, Verdict};
use crate::result::DegeneracyPolicy;
use crate::result::{IcpResult, StopReason};
use crate::system::System;
use crate::target::IcpTarget;
use point_cloud::Cloud;
use point_cloud::{UnorganisedNormalOptions, unorganised_normals};
use rigid_pose::{InputError, motion_length, require_pose};

/// Steps after which it is asked whether they still shrink.
const PATIENCE: usize = 10;

/// An ICP registration of which every part can be replaced: the stages of `[RusinkiewiczLevoy2001]`.
///
/// The matching carries the target. Every field is public; [`Registration::new`] sets what [`crate::align`] uses.
pub struct Registration<'a> {
    /// Which source points take part.
    pub selection: Box<dyn PointSelection + 'a>,
    /// Where their partners come from.
    pub matching: Box<dyn PointMatching + 'a>,
    /// Which pairs are refused: all parts must keep a pair.
    pub rejection: Vec<Box<dyn PairRejection + 'a>>,
    /// How much pairs count: the weights multiply.
    pub weighting: Vec<Box<dyn PairWeighting + 'a>>,
    /// What is minimised.
    pub metric: Box<dyn ErrorMetric + 'a>,
    /// How it is minimised.
    pub minimisation: Box<dyn Minimiser + 'a>,
    /// Robust kernel; its scale is the median absolute deviation of the residuals, anew in each iteration.
    pub kernel: RobustKernel,
    /// Distance limits from coarse to fine.
    pub levels: Levels,
    /// More starts where the guess alone does not convince.
    pub starts: Option<Starts>,
    /// Other kernels and rejections for the way down the levels; where there are any, they replace those above until the
    /// last level, and the pose at which most of a sample fits goes on.
    pub alternatives: Vec<Alternative<'a>>,
    /// Iterations in all levels together. The last level ends before, when a step moves points at the target's radius by less than 1e-5 of
    /// it, or when steps no longer shrink and stay far below the noise. Default 100.
    pub max_iterations: usize,
    /// What happens to motions that the geometry does not determine.
    pub degeneracy: DegeneracyPolicy,
    /// Covariance of the guess in the tangent `[dt target axes, dtheta source axes]`, for
    /// [`DegeneracyPolicy::HoldAtPrior`].
    pub prior_covariance: Option<Matrix6<f64>>,
    /// Motions whose predicted standard deviation exceeds this at the radius of the pairs are undetermined, metre.
    /// `None`: 1/300 of the target's radius.
    pub max_motion_sigma_m: Option<f64>,
    /// Fewest pairs. Default 20.
    pub min_correspondences: usize,
}

impl<'a> Registration<'a> {
    /// Point to plane with the given matching, and the defaults of [`IcpOptions`].
    pub fn new(matching: impl PointMatching + 'a) -> Self {
        IcpOptions::default().with_matching(matching)
    }

    /// The parts that stand for the options of the easy tier.
    pub fn with_options(target: &'a IcpTarget, options: &IcpOptions) -> Self {
        options.with_matching(NearestPoint::new(target))
    }

    /// Aligns `source` with the target of the matching, starting at `guess` (both poses `target_from_source`). Normals of
    /// a source without any are estimated.
    ///
    /// # Errors
    /// [`InputError::TooFewCorrespondences`] where the clouds do not overlap at the guess; [`InputError::Empty`],
    /// [`InputError::NonFinite`], [`InputError::LengthMismatch`], [`InputError::NotPositive`], [`InputError::InvalidOption`],
    /// [`Error::Incompatible`] for the input and the parts.
    pub fn align(&self, source: &Cloud, guess: &Isometry3<f64>) -> Result<IcpResult> {
        source.validate("the source cloud")?;
        let estimated;
        let normals = if let Some(given) = &source.normals {
            given
        } else {
            estimated = unorganised_normals(&source.points, &UnorganisedNormalOptions::default())?;
            &estimated
        };
        let engine = Engine::new(self, source, normals, guess)?;
        let selected = engine.selected()?;
        let limits = self.levels.limits(&engine, &selected, guess)?;
        let mut track = engine.descend(&selected, guess, &limits)?;
        let mut points = Points::new(selected);
        let last_limit_m = limits[limits.len() - 1];
        let mut stop = engine.settle(&mut track, &mut points, last_limit_m)?;
        if self.degeneracy != DegeneracyPolicy::Report {
            let moment = Moment { ended: true, ..track.moment(last_limit_m) };
            let verdict = engine.verdict(&moment, &mut points, track.iterations)?;
            if let Some((pose, free)) = verdict.back_at(guess, &track.pose) {
                (track.pose, track.free) = (pose, free);
                stop = engine.settle(&mut track, &mut points, last_limit_m)?;
            }
        }
        engine.result(&track, &mut points, last_limit_m, guess, stop)
    }
}

/// The parts at work on two surfaces.
#[derive(Clone, Copy)]
pub(crate) struct Engine<'p> {
    pub parts: &'p Registration<'p>,
    pub scene: Scene<'p>,
    pub metric: &'p dyn ErrorMetric,
    pub rejection: &'p [Box<dyn PairRejection + 'p>],
    pub kernel: RobustKernel,
}

/// A pose on its way.
#[derive(Clone)]
pub(crate) struct Track {
    pub pose: Isometry3<f64>,
    pub iterations: usize,
    pub free: Free,
}

impl Track {
    /// Where the run is at this pose.
    pub(crate) fn moment(&self, limit_m: f64) -> Moment {
        Moment { pose: self.pose, limit_m, ended: false }
    }
}

impl<'p> Engine<'p> {
    fn new(
        parts: &'p Registration<'p>,
        source: &'p Cloud,
        source_normals: &'p [Vector3<f64>],
        guess: &Isometry3<f64>,
    ) -> Result<Self> {
        require_pose("the guess", guess)?;
        let target = parts.matching.target();
        let moment = Moment { pose: *guess, limit_m: f64::INFINITY, ended: false };
        let with_normal = source_normals.iter().filter(|n| !n.x.is_nan()).count();
        let is_surface = 2 * with_normal >= source.len();
        let scene = Scene { source, source_normals, is_surface, target, moment };
        parts.validate(&scene)?;
        Ok(Self { parts, scene, metric: &*parts.metric, rejection: &parts.rejection, kernel: parts.kernel })
    }

    /// The selected points, all of which exist.
    fn selected(&self) -> Result<Vec<usize>> {
        let (selected, count) = (self.parts.selection.select(&self.scene)?, self.scene.source.len());
        match selected.iter().find(|&&point| point >= count) {
            Some(&point) => Err(Error::NoSuchPoint { part: "the selection", point, count }),
            None => Ok(selected),
        }
    }

    /// Iterates on all selected points at the last limit.
    fn settle(&self, track: &mut Track, points: &mut Points, limit_m: f64) -> Result<StopReason> {
        let tolerance_m = SMALL_STEP * self.scene.target.radius_m;
        let mut lengths = Vec::new();
        while track.iterations < self.parts.max_iterations {
            let step = self.step(track, &track.moment(limit_m), points)?;
            lengths.push(motion_length(&step));
            if motion_length(&step) <= tolerance_m {
                return Ok(StopReason::Converged);
            }
            let first = lengths.len().checked_sub(PATIENCE).filter(|_| lengths.len().is_multiple_of(PATIENCE));
            if first.is_some_and(|first| motion_length(&step) >= 0.5 * lengths[first]) {
                let verdict = self.verdict(&track.moment(limit_m), points, track.iterations)?;
                if verdict.over_sigma(&step) <= 0.1 {
                    return Ok(StopReason::WithinNoise);
                }
            }
        }
        Ok(StopReason::MaxIterations)
    }

    /// One iteration: pairs, residuals, a motion `[dt, rho w]`, as taken.
    pub(crate) fn step(&self, track: &mut Track, moment: &Moment, points: &mut Points) -> Result<Vector6<f64>> {
        let pairs = self.pairs(moment, points, track.iterations)?;
        let scene = self.scene.at(*moment);
        let system = System::new(&scene, self.metric, &pairs, self.kernel).in_frame(track.free.frame);
        let mut step = self.parts.minimisation.step(&system, &track.free.projection)?;
        // Pairs at most `limit` apart give no reason to move farther than a few times that.
        let excess = motion_length(&step) / (2.0 * moment.limit_m);
        if excess > 1.0 {
            step /= excess;
        }
        if !step.iter().all(|v| v.is_finite()) {
            return Err(InputError::Numerical { what: "a step of the registration", why: "it is not finite" }.into());
        }
        track.pose = system.moved(&step);
        track.iterations += 1;
        Ok(step)
    }

    /// What the pairs of a moment say about its pose.
    fn verdict(&self, moment: &Moment, points: &mut Points, iterations: usize) -> Result<Verdict> {
        let pairs = self.pairs(moment, points, iterations)?;
        let scene = self.scene.at(*moment);
        verdict(&System::new(&scene, self.metric, &pairs, self.kernel), self.max_motion_sigma_m())
    }

    pub(crate) fn max_motion_sigma_m(&self) -> f64 {
        self.parts.max_motion_sigma_m.unwrap_or(OPEN * self.scene.target.radius_m)
    }
}
