//! Which pairs do not count.

use rigid_pose::{require_option, require_positive};
use statistics::ranked;

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

    /// Refuses parameters outside their domain.
    fn validate(&self) -> Result<()> {
        Ok(())
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

    fn validate(&self) -> Result<()> {
        Ok(require_positive("max_normal_angle_rad", self.0)?)
    }
}

/// Keeps this fraction of the pairs, those with the smallest distances `[Chetverikov2002]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trimmed(pub f64);

impl PairRejection for Trimmed {
    fn reject(&self, _: &Scene<'_>, pairs: &mut Vec<Pair>) {
        if self.0 < 1.0 {
            let mut distances: Vec<f64> = pairs.iter().map(|p| p.distance_m).collect();
            let limit = ranked(&mut distances, self.0);
            pairs.retain(|p| p.distance_m <= limit);
        }
    }

    fn validate(&self) -> Result<()> {
        Ok(require_option("trim", self.0, "above 0 and at most 1", |share| share > 0.0 && share <= 1.0)?)
    }
}

/// Pairs whose target point lies at the rim of what was seen, or mixes two surfaces ([`crate::Cloud::rim`]) `[TurkLevoy1994]`:
/// points beyond the edge of the target all find their partner on the edge and pull the clouds together.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct TargetRim;

impl PairRejection for TargetRim {
    fn keeps(&self, scene: &Scene<'_>, pair: &Pair) -> bool {
        match (scene.target.cloud.and_then(|cloud| cloud.rim.as_ref()), pair.target) {
            (Some(rim), Some(index)) => !rim[index],
            _ => true,
        }
    }
}
