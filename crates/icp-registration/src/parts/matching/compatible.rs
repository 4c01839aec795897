//! The nearest point of a cloud whose normal agrees.

use rigid_pose::{require_count, require_positive};

use super::nearest::partner_at;
use super::{Partner, PointMatching, Query};
use crate::error::Result;
use crate::parts::scene::TargetSurface;
use crate::target::IcpTarget;

/// The nearest of the k nearest points whose normal encloses less than an angle with that of the source point
/// `[Pulli1999]`: at edges and thin walls the nearest point may lie on the wrong face, the next one on the right one.
#[derive(Debug, Clone, Copy)]
pub struct CompatibleNearest<'a> {
    target: &'a IcpTarget,
    /// Points looked at. Default 8.
    pub neighbours: usize,
    /// Largest angle between the normals, radian; their sign does not count. Default 45 degrees.
    pub max_angle_rad: f64,
}

impl<'a> CompatibleNearest<'a> {
    /// Matches with the points of `target`.
    pub fn new(target: &'a IcpTarget) -> Self {
        Self { target, neighbours: 8, max_angle_rad: std::f64::consts::FRAC_PI_4 }
    }
}

impl PointMatching for CompatibleNearest<'_> {
    fn target(&self) -> TargetSurface<'_> {
        self.target.surface()
    }

    fn partner(&self, query: &Query) -> Partner {
        let Ok(neighbours) = self.target.tree.k_nearest(&query.moved.into(), self.neighbours) else {
            return Partner::none(0.0);
        };
        let near = neighbours.iter().take_while(|n| n.distance_m <= query.limit_m);
        let mut agree = near.filter(|n| {
            let cosine = query.normal.dot(&self.target.normals[n.index]).abs();
            // A point without a normal has nothing to agree on and is taken for what it is.
            query.normal.x.is_nan() || cosine >= self.max_angle_rad.cos()
        });
        agree.next().map_or(Partner::none(0.0), |n| partner_at(self.target, n.index, 0.0))
    }

    fn validate(&self) -> Result<()> {
        require_count("neighbours", self.neighbours, 1)?;
        Ok(require_positive("max_angle_rad", self.max_angle_rad)?)
    }
}
