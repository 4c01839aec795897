//! What can be chosen.

use rigid_pose::{require_count, require_positive};

use crate::error::Result;
use crate::kernel::RobustKernel;
use crate::result::DegeneracyPolicy;

/// How two clouds of voxels are aligned. The defaults carry no scale.
#[derive(Debug, Clone, PartialEq)]
pub struct VoxelAlignmentOptions {
    /// Largest distance by which the guess may misplace points, metre. `None`, the default: as far as half of the
    /// target's radius, found by a search from several sides. A small distance saves that search.
    pub max_start_error_m: Option<f64>,
    /// Robust kernel of the finest level; its scale is the median absolute deviation of the residuals, anew in each
    /// iteration. Default: [`RobustKernel::Welsch`].
    pub kernel: RobustKernel,
    /// Iterations in all levels together. Default 100.
    pub max_iterations: usize,
    /// What happens to undetermined motions. Default: [`DegeneracyPolicy::Report`].
    pub degeneracy: DegeneracyPolicy,
    /// A motion counts as undetermined when the predicted standard deviation of points at the cloud's radius exceeds
    /// this, metre. `None`, the default: 1/300 of the radius.
    pub max_motion_sigma_m: Option<f64>,
}

impl Default for VoxelAlignmentOptions {
    fn default() -> Self {
        Self {
            max_start_error_m: None,
            kernel: RobustKernel::Welsch,
            max_iterations: 100,
            degeneracy: DegeneracyPolicy::Report,
            max_motion_sigma_m: None,
        }
    }
}

impl VoxelAlignmentOptions {
    pub(crate) fn validate(&self) -> Result<()> {
        require_positive("max_start_error_m", self.max_start_error_m)?;
        require_positive("max_motion_sigma_m", self.max_motion_sigma_m)?;
        Ok(require_count("max_iterations", self.max_iterations, 1)?)
    }
}
