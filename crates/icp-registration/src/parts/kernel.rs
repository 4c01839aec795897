//! Robust kernels in the course of a run.

use rigid_pose::{require_count, require_positive};

use super::scene::Moment;
use crate::error::Result;
use crate::kernel::RobustKernel;

/// Which kernel judges the residuals at a moment, and how much wider than their scale.
pub trait KernelSchedule: Sync {
    /// The kernel and the factor (1 or more) on the scale, the median absolute deviation of the residuals. A level goes
    /// on until the factor is 1.
    fn at(&self, moment: &Moment) -> (RobustKernel, f64);

    /// Refuses parameters outside their domain.
    fn validate(&self) -> Result<()> {
        Ok(())
    }
}

/// The same kernel throughout.
impl KernelSchedule for RobustKernel {
    fn at(&self, _: &Moment) -> (RobustKernel, f64) {
        (*self, 1.0)
    }
}

/// A kernel whose scale falls from wide to narrow within the last level, and stays wide before: graduated
/// non-convexity `[Yang2020]`. Redescending kernels alone keep what fits by chance at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Graduated {
    /// The kernel.
    pub kernel: RobustKernel,
    /// Factor on the scale at the start. Default 4.
    pub widest: f64,
    /// Iterations in which the factor halves. Default 1.
    pub half_life: usize,
}

impl Default for Graduated {
    fn default() -> Self {
        Self { kernel: RobustKernel::Welsch, widest: 4.0, half_life: 1 }
    }
}

impl KernelSchedule for Graduated {
    fn at(&self, moment: &Moment) -> (RobustKernel, f64) {
        if moment.ended {
            return (self.kernel, 1.0);
        }
        if moment.level + 1 < moment.levels {
            return (self.kernel, self.widest.max(1.0));
        }
        let halvings = moment.iteration as f64 / self.half_life.max(1) as f64;
        (self.kernel, (self.widest * (-halvings).exp2()).max(1.0))
    }

    fn validate(&self) -> Result<()> {
        require_positive("widest", self.widest)?;
        Ok(require_count("half_life", self.half_life, 1)?)
    }
}
