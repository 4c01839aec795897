//! The iterative closest point algorithm.

mod coarse;
mod matching;
pub(crate) mod motion;
mod options;
mod quality;
mod selection;
mod sensitivity;
mod system;
mod target;

pub use motion::{MotionKind, UndeterminedMotion};
pub use options::{DegeneracyPolicy, IcpOptions, Metric, Selection};
pub use target::IcpTarget;

use nalgebra::{Isometry3, Matrix6, Vector3, Vector6};

use crate::cloud::Cloud;
use crate::error::{Error, Result};
use crate::normals::{UnorganisedNormalOptions, unorganised_normals};
use crate::pose::is_finite;
use coarse::{COARSE_POINTS, Track, descend, length};
use matching::{Matcher, Pair};
use quality::{Residuals, Verdict};
use system::System;

/// Steps of the last level after which it is asked whether they still shrink.
const WANDERING: usize = 10;

/// Why the iterations ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StopReason {
    /// The last step was below the tolerance.
    Converged,
    /// The pose wanders by less than a tenth of its standard deviation, as pairs change back and forth.
    WithinNoise,
    /// The iterations were used up: do not trust the pose.
    MaxIterations,
}

/// Result of a registration.
#[derive(Debug, Clone, PartialEq)]
pub struct IcpResult {
    /// Pose: `target = target_from_source * source`.
    pub target_from_source: Isometry3<f64>,
    /// Covariance in the tangent `[dt target axes (m), dtheta source axes (rad)]`. Motions that the pairs say nothing
    /// about carry the radius of the pairs as standard deviation.
    pub covariance: Matrix6<f64>,
    /// Fraction of the source points that have a partner at the final pose.
    pub overlap: f64,
    /// Root mean square residual of the metric, weighted by the kernel, metre.
    pub rms_m: f64,
    /// Iterations in all levels together.
    pub iterations: usize,
    /// Why they ended.
    pub stop: StopReason,
    /// Pairs in the last iteration.
    pub correspondences: usize,
    /// Distance limit of the last level, metre.
    pub max_correspondence_distance_m: f64,
    /// Motions that the geometry does not determine; empty for a sound pose.
    pub degenerate: Vec<UndeterminedMotion>,
}

impl IcpResult {
    /// Whether the iterations settled and the geometry determines all six unknowns.
    pub fn is_trustworthy(&self) -> bool {
        self.stop != StopReason::MaxIterations && self.degenerate.is_empty()
    }
}

/// Aligns `source` with `target`, starting at `guess` (both poses `target_from_source`).
///
/// Clouds without normals get them from their nearest neighbours where the metric needs them. For several sources
/// against one target, build an [`IcpTarget`] once.
///
/// # Errors
/// [`Error::TooFewCorrespondences`] where the clouds do not overlap at the guess; [`Error::Empty`],
/// [`Error::NonFinite`], [`Error::LengthMismatch`], [`Error::NotPositive`], [`Error::InvalidOption`] for the input.
pub fn align(source: &Cloud, target: &Cloud, guess: &Isometry3<f64>, options: &IcpOptions) -> Result<IcpResult> {
    IcpTarget::new(target.clone())?.align(source, guess, options)
}

pub(crate) fn run(
    source: &Cloud,
    target: &IcpTarget,
    guess: &Isometry3<f64>,
    options: &IcpOptions,
) -> Result<IcpResult> {
    options.validate()?;
    source.validate("the source cloud")?;
    if !is_finite(guess) {
        return Err(Error::NonFinite { what: "the guess", index: 0 });
    }
    let estimated;
    let source_normals: Option<&[Vector3<f64>]> = match (&source.normals, options.metric) {
        (Some(normals), Metric::PointToPlane) => Some(normals),
        (Some(normals), _) => target.normals_given.then_some(normals.as_slice()),
        (None, Metric::PointToPlane) => {
            estimated = unorganised_normals(&source.points, &UnorganisedNormalOptions::default())?;
            Some(&estimated)
        }
        (None, _) => None,
    };
    let matcher = Matcher { source, source_normals, target, options: options.clone() };
    let selected = selection::select(options.selection, source.len(), source_normals.unwrap_or(&[]));
    Run { matcher, selected, track: Track { pose: *guess, iterations: 0 } }.finish()
}

struct Run<'a> {
    matcher: Matcher<'a>,
    selected: Vec<usize>,
    track: Track,
}

impl Run<'_> {
    fn finish(mut self) -> Result<IcpResult> {
        let limits = self.limits()?;
        let limit = limits[limits.len() - 1];
        self.track = descend(&self.matcher, &self.selected, &self.track.pose, &limits, self.max_motion_sigma_m())?;
        let stop = self.settle(limit)?;
        self.result(limit, stop)
    }

    /// Distance limits from the first level to the last, each half of the one before.
    fn limits(&self) -> Result<Vec<f64>> {
        let (options, target) = (&self.matcher.options, self.matcher.target);
        let last = options.max_correspondence_distance_m.unwrap_or(if target.spacing_m > 0.0 {
            3.0 * target.spacing_m
        } else {
            target.radius_m.max(f64::MIN_POSITIVE)
        });
        let first = if let Some(first) = options.initial_correspondence_distance_m {
            first
        } else {
            let sample = selection::thinned(&self.selected, 1000);
            let median = self.matcher.median_distance(&self.track.pose, &sample)?;
            (2.5 * median).max(target.radius_m / 4.0).min(target.radius_m)
        };
        let mut limits = vec![last];
        while let Some(&limit) = limits.last()
            && limit * 2.0 <= first
        {
            limits.push(limit * 2.0);
        }
        if limits.last().is_some_and(|&limit| limit < first) {
            limits.push(first);
        }
        limits.reverse();
        Ok(limits)
    }

    /// Iterates on all selected points at the last limit.
    fn settle(&mut self, limit: f64) -> Result<StopReason> {
        let tolerance = self.matcher.options.step_tolerance_m.unwrap_or(1e-5 * self.matcher.target.radius_m);
        let mut lengths = Vec::new();
        while self.track.iterations < self.matcher.options.max_iterations {
            let step = self.track.step(&self.matcher, &self.selected, limit, self.max_motion_sigma_m())?;
            lengths.push(length(&step));
            if length(&step) <= tolerance {
                return Ok(StopReason::Converged);
            }
            if lengths.len() % WANDERING == 0 && self.wanders(limit, &step, &lengths)? {
                return Ok(StopReason::WithinNoise);
            }
        }
        Ok(StopReason::MaxIterations)
    }

    /// Whether the steps have stopped shrinking, far below the standard deviation of the pose.
    fn wanders(&self, limit: f64, step: &Vector6<f64>, lengths: &[f64]) -> Result<bool> {
        let shrinking = lengths[lengths.len() - 1] < 0.5 * lengths[lengths.len() - WANDERING];
        let pairs = self.pairs(limit)?;
        let system = System::new(&self.matcher, &pairs);
        let verdict = Verdict::new(&system, &self.track.pose, self.max_motion_sigma_m(), Residuals::Settled)?;
        Ok(!shrinking && verdict.is_within_noise(step, 0.1))
    }

    fn pairs(&self, limit: f64) -> Result<Vec<Pair>> {
        self.matcher.enough_pairs(&self.track.pose, &self.selected, limit, self.track.iterations)
    }

    fn max_motion_sigma_m(&self) -> f64 {
        self.matcher.options.max_motion_sigma_m.unwrap_or(self.matcher.target.radius_m / 300.0)
    }

    fn result(&self, limit: f64, stop: StopReason) -> Result<IcpResult> {
        let pose = self.track.pose;
        let pairs = self.pairs(limit)?;
        let system = System::new(&self.matcher, &pairs);
        let verdict = Verdict::new(&system, &pose, self.max_motion_sigma_m(), Residuals::Settled)?;
        let sample = selection::thinned(&self.selected, COARSE_POINTS);
        let step = (0.5 * system.rms_m()).max(0.01 * limit);
        let response = sensitivity::sensitivity(&system, &pose, &sample, limit, step)?;
        let all: Vec<usize> = selection::thinned(&(0..self.matcher.source.len()).collect::<Vec<_>>(), 20_000);
        let partners = self.matcher.pairs(&pose, &all, limit)?.len();
        Ok(IcpResult {
            target_from_source: pose,
            covariance: verdict.covariance(&system, &pose, &response),
            overlap: partners as f64 / all.len() as f64,
            rms_m: system.rms_m(),
            iterations: self.track.iterations,
            stop,
            correspondences: pairs.len(),
            max_correspondence_distance_m: limit,
            degenerate: verdict.undetermined(&system),
        })
    }
}
