//! What a registration returns, and what it does about motions that the geometry leaves open.

use nalgebra::{Isometry3, Matrix6};

use crate::quality::UndeterminedMotion;

/// What happens to motions that the geometry does not determine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum DegeneracyPolicy {
    /// They are named in the result; the pose may have slid along them.
    #[default]
    Report,
    /// They are named, and the pose keeps the guess along them (to first order).
    HoldAtGuess,
    /// As [`DegeneracyPolicy::HoldAtGuess`], and at the end the guess enters as an observation with its
    /// `prior_covariance`: what the geometry leaves open stays at the guess with the guess's standard deviation.
    HoldAtPrior,
}

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
    /// Iterations ended, but the frames contradict each other at the pose, hide too much from each other or hardly meet:
    /// do not trust it.
    Contradicted,
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
    /// Whether the iterations settled, the geometry determines all six unknowns, and frames do not contradict the pose.
    pub fn is_trustworthy(&self) -> bool {
        !matches!(self.stop, StopReason::MaxIterations | StopReason::Contradicted) && self.degenerate.is_empty()
    }
}
