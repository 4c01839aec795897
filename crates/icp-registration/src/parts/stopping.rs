//! When the iterations of the last level end.

use rigid_pose::{require_count, require_positive};

use crate::error::Result;
use crate::result::StopReason;

/// When a run ends.
pub trait StoppingRule: Sync {
    /// Iterations that all levels together may take.
    fn max_iterations(&self) -> usize;

    /// Asked after each step of the last level.
    fn decide(&self, progress: &mut Progress<'_>) -> Result<Option<StopReason>>;

    /// Refuses parameters outside their domain.
    fn validate(&self) -> Result<()> {
        Ok(())
    }
}

/// The steps of the last level so far.
pub struct Progress<'a> {
    /// Length of each step: the larger of translation and movement by rotation at the radius of the pairs, metre.
    pub step_lengths_m: &'a [f64],
    /// Radius of the target, metre.
    pub radius_m: f64,
    pub(crate) step_over_sigma: &'a mut dyn FnMut() -> Result<f64>,
}

impl Progress<'_> {
    /// The last step over the standard deviation of the pose, along the determined motion where it is largest. Costs as
    /// much as a step.
    pub fn step_over_sigma(&mut self) -> Result<f64> {
        (self.step_over_sigma)()
    }
}

/// Ends when a step is below a tolerance, or when steps no longer shrink far below the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settled {
    /// Iterations in all levels together. Default 100.
    pub max_iterations: usize,
    /// Step below which the run has converged, metre. `None`: 1e-5 of the target's radius.
    pub step_tolerance_m: Option<f64>,
    /// Steps after which it is asked whether they still shrink. Default 10.
    pub patience: usize,
    /// Fraction of the standard deviation of the pose within which steps that do not shrink may stay. Default 0.1.
    pub noise_fraction: f64,
}

impl Default for Settled {
    fn default() -> Self {
        Self { max_iterations: 100, step_tolerance_m: None, patience: 10, noise_fraction: 0.1 }
    }
}

impl StoppingRule for Settled {
    fn max_iterations(&self) -> usize {
        self.max_iterations
    }

    fn decide(&self, progress: &mut Progress<'_>) -> Result<Option<StopReason>> {
        let lengths = progress.step_lengths_m;
        let Some(&last) = lengths.last() else { return Ok(None) };
        if last <= self.step_tolerance_m.unwrap_or(1e-5 * progress.radius_m) {
            return Ok(Some(StopReason::Converged));
        }
        if !lengths.len().is_multiple_of(self.patience) || last < 0.5 * lengths[lengths.len() - self.patience] {
            return Ok(None);
        }
        Ok((progress.step_over_sigma()? <= self.noise_fraction).then_some(StopReason::WithinNoise))
    }

    fn validate(&self) -> Result<()> {
        require_count("max_iterations", self.max_iterations, 1)?;
        require_count("patience", self.patience, 1)?;
        require_positive("noise_fraction", self.noise_fraction)?;
        Ok(require_positive("step_tolerance_m", self.step_tolerance_m)?)
    }
}
