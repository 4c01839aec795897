//! When the iterations of the last level end.

use rigid_pose::{require_count, require_positive};

use crate::error::Result;

/// The last level ends when a step is below a tolerance, or when steps no longer shrink far below the noise.
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

impl Settled {
    /// Whether steps of these lengths no longer shrink.
    pub(super) fn no_longer_shrink(&self, lengths_m: &[f64]) -> bool {
        lengths_m.len().is_multiple_of(self.patience)
            && lengths_m.last().is_some_and(|last| *last >= 0.5 * lengths_m[lengths_m.len() - self.patience])
    }

    pub(super) fn validate(&self) -> Result<()> {
        require_count("max_iterations", self.max_iterations, 1)?;
        require_count("patience", self.patience, 1)?;
        require_positive("noise_fraction", self.noise_fraction)?;
        Ok(require_positive("step_tolerance_m", self.step_tolerance_m)?)
    }
}
