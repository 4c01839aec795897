//! How much a pair counts.

mod intensity;
mod sigma;

pub use intensity::IntensityWeight;
pub use sigma::SigmaWeight;

use rigid_pose::require_positive;

use super::scene::{Pair, Scene};
use crate::error::Result;

/// Gives weights to pairs. Several multiply; a pair of weight zero is left out.
///
/// Weights are relative precisions: the robust kernel judges the residual times the root of the weight.
pub trait PairWeighting: Sync {
    /// Multiplies the weight of each pair.
    fn weigh(&self, scene: &Scene<'_>, pairs: &mut [Pair]);

    /// Refuses parameters outside their domain.
    fn validate(&self) -> Result<()> {
        Ok(())
    }
}

/// All pairs the same `[RusinkiewiczLevoy2001]`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ConstantWeight;

impl PairWeighting for ConstantWeight {
    fn weigh(&self, _: &Scene<'_>, _: &mut [Pair]) {}
}

/// `1 − distance / (limit of the moment)` `[GodinRiouxBaribeau1994]`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DistanceWeight;

impl PairWeighting for DistanceWeight {
    fn weigh(&self, scene: &Scene<'_>, pairs: &mut [Pair]) {
        for pair in pairs {
            pair.weight *= (1.0 - pair.distance_m / scene.moment.limit_m).max(0.0);
        }
    }
}

/// Cosine of the angle between the normals `[RusinkiewiczLevoy2001]`, to a power; 1 where one of them is missing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NormalWeight {
    /// The power. Default 1.
    pub power: f64,
}

impl Default for NormalWeight {
    fn default() -> Self {
        Self { power: 1.0 }
    }
}

impl PairWeighting for NormalWeight {
    fn weigh(&self, _: &Scene<'_>, pairs: &mut [Pair]) {
        for pair in pairs.iter_mut().filter(|pair| pair.has_normals()) {
            pair.weight *= pair.normal.dot(&pair.source_normal).abs().powf(self.power);
        }
    }

    fn validate(&self) -> Result<()> {
        Ok(require_positive("power", self.power)?)
    }
}
