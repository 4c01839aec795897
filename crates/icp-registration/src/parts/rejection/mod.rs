//! Which pairs do not count.

mod quantiles;
mod rim;

pub use quantiles::{MedianDistance, Trimmed};
pub use rim::{MutualNearest, SourceRim, TargetRim};

use rigid_pose::require_positive;

use super::scene::{Pair, Scene};
use crate::error::Result;

/// Refuses pairs: one by one, or in view of all that are left.
pub trait PairRejection: Sync {
    /// Whether a pair may stay, whatever the others are.
    fn keeps(&self, _scene: &Scene<'_>, _pair: &Pair) -> bool {
        true
    }

    /// Takes out of all pairs (those that every part keeps) the ones that do not fit among them.
    fn reject(&self, _scene: &Scene<'_>, _pairs: &mut Vec<Pair>) {}

    /// Refuses parameters outside their domain, and attributes that are needed and missing.
    fn validate(&self, _scene: &Scene<'_>) -> Result<()> {
        Ok(())
    }
}

/// Pairs farther apart than this, metre `[RusinkiewiczLevoy2001]`, besides the limits of the levels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaxDistance(pub f64);

impl PairRejection for MaxDistance {
    fn keeps(&self, _: &Scene<'_>, pair: &Pair) -> bool {
        pair.distance_m <= self.0
    }

    fn validate(&self, _: &Scene<'_>) -> Result<()> {
        Ok(require_positive("max_distance_m", self.0)?)
    }
}

/// Pairs whose normals enclose more than this angle, radian `[Pulli1999]`; the sign of normals does not count, and
/// pairs of which one normal is missing stay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaxNormalAngle(pub f64);

impl PairRejection for MaxNormalAngle {
    fn keeps(&self, _: &Scene<'_>, pair: &Pair) -> bool {
        let cosine = pair.source_normal.dot(&pair.normal).abs();
        cosine.is_nan() || cosine >= self.0.cos()
    }

    fn validate(&self, _: &Scene<'_>) -> Result<()> {
        Ok(require_positive("max_normal_angle_rad", self.0)?)
    }
}
