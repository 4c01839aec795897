//! What may be chosen.

use point_uncertainty::SharedErrorGrid;
use statistics::Distribution;

use crate::{Error, Result};

/// What is done with errors that points have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CommonErrorUse {
    /// Surfaces that several frames see tell how their common errors differ; these are taken off, and what remains is
    /// known better. Walls become as thin as their noise allows.
    #[default]
    Estimate,
    /// Points stay where they are and common errors are as stated: where poses err, walls are seen to be weighted means of
    /// several.
    AsStated,
}

/// Options of [`fuse`](crate::fuse).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FusionOptions {
    /// Spacing of the fused points and size of the cells that planes are fitted in, metre. Smaller cells keep finer shapes
    /// and average less noise. Default 0.05.
    pub voxel_m: f64,
    /// Probability that anything is said to contradict in a survey without contradictions: for stations as a whole and, apart
    /// from these, for surfels. Default 0.05.
    pub level: f64,
    /// Probability that a point that belongs to a surface is left out of it as too far away. Default 1e-4.
    pub outlier_level: f64,
    /// What is done with common errors. Default: they are estimated.
    pub common_errors: CommonErrorUse,
    /// Those of the common errors that are the error that all frames of a sensor share. How large it is and how far it is alike in
    /// the image is estimated as well: what is stated of their covariance is not used. Default: none.
    pub shared_error: Option<SharedErrorGrid>,
}

impl Default for FusionOptions {
    fn default() -> Self {
        Self {
            voxel_m: 0.05,
            level: 0.05,
            outlier_level: 1e-4,
            common_errors: CommonErrorUse::Estimate,
            shared_error: None,
        }
    }
}

impl FusionOptions {
    pub(crate) fn check(&self) -> Result<()> {
        if !(self.voxel_m > 0.0 && self.voxel_m.is_finite()) {
            return Err(Error::OutOfDomain { name: "voxel_m", value: self.voxel_m, expected: "positive and finite" });
        }
        for (name, value) in [("level", self.level), ("outlier_level", self.outlier_level)] {
            if !(value > 0.0 && value < 1.0) {
                return Err(Error::OutOfDomain { name, value, expected: "a probability between 0 and 1" });
            }
        }
        Ok(())
    }

    /// Standard deviations that a point may lie off its surface.
    pub(crate) fn gate(&self) -> f64 {
        Distribution::Normal.critical(self.outlier_level)
    }
}
