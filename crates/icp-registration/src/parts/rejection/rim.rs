//! Pairs that mislead because one of the clouds ends there.

use nalgebra::Point3;

use super::PairRejection;
use crate::error::Result;
use crate::parts::scene::{Pair, Scene};
use point_cloud::Cloud;
use point_cloud::NeighbourTree;
use rigid_pose::{require_length, require_option};

/// Pairs whose target point lies at the rim of what was seen, or mixes two surfaces ([`Cloud::rim`]) `[TurkLevoy1994]`:
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

/// Pairs whose source point lies at the rim or mixes two surfaces ([`Cloud::rim`]): a mixed pixel belongs to neither.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SourceRim;

impl PairRejection for SourceRim {
    fn keeps(&self, scene: &Scene<'_>, pair: &Pair) -> bool {
        scene.source.rim.as_ref().is_none_or(|rim| !rim[pair.source])
    }
}

/// Pairs that are not nearest from both sides `[Pajdla1995]`: the source point nearest to the partner must lie within a
/// tolerance of the source point that found it.
#[derive(Debug)]
pub struct MutualNearest {
    tree: NeighbourTree,
    points: Vec<Point3<f64>>,
    /// How far apart the two may be, metre. Zero: they must be the same point.
    pub tolerance_m: f64,
}

impl MutualNearest {
    /// For a registration of `source`.
    ///
    /// # Errors
    /// [`InputError::Empty`](rigid_pose::InputError::Empty), [`InputError::NonFinite`](rigid_pose::InputError::NonFinite) for its points.
    pub fn new(source: &Cloud, tolerance_m: f64) -> Result<Self> {
        Ok(Self { tree: NeighbourTree::new(&source.points)?, points: source.points.clone(), tolerance_m })
    }
}

impl PairRejection for MutualNearest {
    fn keeps(&self, scene: &Scene<'_>, pair: &Pair) -> bool {
        let back = scene.moment.pose.inverse_transform_point(&Point3::from(pair.point));
        self.tree
            .nearest(&back)
            .is_ok_and(|nearest| (self.points[nearest.index] - self.points[pair.source]).norm() <= self.tolerance_m)
    }

    fn validate(&self, scene: &Scene<'_>) -> Result<()> {
        require_length("the source cloud of the mutual neighbours", scene.source.len(), self.points.len())?;
        let is_inside = |tolerance: f64| tolerance >= 0.0 && tolerance.is_finite();
        Ok(require_option("tolerance_m", self.tolerance_m, "0 or more and finite", is_inside)?)
    }
}
