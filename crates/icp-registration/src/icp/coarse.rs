//! From the guess to the neighbourhood of the answer: levels of falling distance limits on a sample of the points.
//!
//! What draws a pose in from afar differs with the scene: least squares and free normals reach farthest where the clouds
//! overlap well, compatible normals where they overlap little, and either can slide along a wall into a wrong pose. All
//! are tried, and the pose at which most of the sample fits goes on.

use nalgebra::{Isometry3, Vector6};

use super::matching::Matcher;
use super::options::{DegeneracyPolicy, IcpOptions};
use super::quality::{Residuals, Verdict};
use super::selection::thinned;
use super::system::System;
use crate::error::{Error, Result};
use crate::kernel::RobustKernel;
use crate::pose::move_about;

/// Source points that the coarse levels work with.
pub(crate) const COARSE_POINTS: usize = 4000;
/// Iterations that a level may take.
const LEVEL_ITERATIONS: usize = 12;
/// A level ends when a step is below this fraction of its distance limit.
const LEVEL_STEP: f64 = 0.01;

/// A pose on its way.
pub(crate) struct Track {
    pub pose: Isometry3<f64>,
    pub iterations: usize,
}

/// Runs the levels `limits` (falling) with each variant of the options and returns the best track.
pub(crate) fn descend(
    matcher: &Matcher<'_>,
    selected: &[usize],
    guess: &Isometry3<f64>,
    limits: &[f64],
    max_motion_sigma_m: f64,
) -> Result<Track> {
    let sample = thinned(selected, COARSE_POINTS);
    let last = limits[limits.len() - 1];
    let mut best: Option<(f64, Track)> = None;
    let mut failure = None;
    for options in variants(&matcher.options) {
        let variant = Variant { matcher: matcher.with_options(options), sample: &sample, max_motion_sigma_m };
        let track = variant.descend(guess, limits).and_then(|t| Ok((fit(matcher, &sample, &t.pose, last)?, t)));
        match track {
            Ok((fit, track)) if best.as_ref().is_none_or(|(best, _)| fit > *best) => best = Some((fit, track)),
            Ok(_) => {}
            Err(error) => failure = failure.or(Some(error)),
        }
    }
    match (best, failure) {
        (Some((_, track)), _) => Ok(track),
        (None, Some(error)) => Err(error),
        (None, None) => Err(Error::Numerical { what: "the coarse registration", why: "there was nothing to try" }),
    }
}

/// Kernels and normal gates that are worth a try.
fn variants(options: &IcpOptions) -> Vec<IcpOptions> {
    let with = |kernel, max_normal_angle_rad| IcpOptions { kernel, max_normal_angle_rad, ..options.clone() };
    let robust = if options.kernel == RobustKernel::None { RobustKernel::None } else { RobustKernel::Huber };
    let mut variants = vec![with(robust, None)];
    if options.max_normal_angle_rad.is_some() {
        variants.push(with(robust, options.max_normal_angle_rad));
        variants.push(with(RobustKernel::None, options.max_normal_angle_rad));
    }
    variants
}

/// Fraction of the distance limit at which a residual counts half in the comparison of tracks.
const FIT_RESIDUAL: f64 = 1.0 / 12.0;

/// How well a sample fits at a pose: its number of pairs, each weighted by its residual.
fn fit(matcher: &Matcher<'_>, sample: &[usize], pose: &Isometry3<f64>, limit: f64) -> Result<f64> {
    let pairs = matcher.pairs(pose, sample, limit)?;
    let system = System::new(matcher, &pairs);
    Ok(pairs.iter().map(|p| 1.0 / (1.0 + (system.residual_length(p) / (FIT_RESIDUAL * limit)).powi(2))).sum())
}

struct Variant<'a> {
    matcher: Matcher<'a>,
    sample: &'a [usize],
    max_motion_sigma_m: f64,
}

impl Variant<'_> {
    fn descend(&self, guess: &Isometry3<f64>, limits: &[f64]) -> Result<Track> {
        let mut track = Track { pose: *guess, iterations: 0 };
        for &limit in limits {
            for _ in 0..LEVEL_ITERATIONS {
                if track.iterations + 1 >= self.matcher.options.max_iterations {
                    return Ok(track);
                }
                let step = track.step(&self.matcher, self.sample, limit, self.max_motion_sigma_m)?;
                if length(&step) < LEVEL_STEP * limit {
                    break;
                }
            }
        }
        Ok(track)
    }
}

impl Track {
    /// One Gauss-Newton step: `[dt, rho w]` in metre as taken.
    pub(crate) fn step(
        &mut self,
        matcher: &Matcher<'_>,
        selected: &[usize],
        limit: f64,
        max_motion_sigma_m: f64,
    ) -> Result<Vector6<f64>> {
        let pairs = matcher.enough_pairs(&self.pose, selected, limit, self.iterations)?;
        let system = System::new(matcher, &pairs);
        let held = match matcher.options.degeneracy {
            DegeneracyPolicy::Report => Vec::new(),
            DegeneracyPolicy::HoldAtGuess => {
                Verdict::new(&system, &self.pose, max_motion_sigma_m, Residuals::Misaligned)?.held()
            }
        };
        let mut step = system.step(&held)?;
        // Pairs at most `limit` apart give no reason to move farther than a few times that.
        let excess = length(&step) / (2.0 * limit);
        if excess > 1.0 {
            step /= excess;
        }
        self.pose = move_about(&self.pose, &system.centre, system.radius_m, &step);
        self.iterations += 1;
        Ok(step)
    }
}

/// Larger of the two parts of a motion.
pub(crate) fn length(motion: &Vector6<f64>) -> f64 {
    motion.fixed_rows::<3>(0).norm().max(motion.fixed_rows::<3>(3).norm())
}
