//! The nearest point of a cloud.

use nalgebra::Vector3;

use super::{Partner, PointMatching, Query};
use crate::parts::scene::TargetSurface;
use crate::target::IcpTarget;

/// Search beyond the limit by this factor: a point without a partner is not asked about again at each small step.
const BEYOND: f64 = 1.25;

/// The nearest point of the target by its k-d tree `[BeslMcKay1992]`.
///
/// The distance of the second nearest tells how far the source point may move before its partner can change; most points
/// are thus searched for only in the first few iterations of a level `[GreenspanGodin2001]`.
#[derive(Debug, Clone, Copy)]
pub struct NearestPoint<'a> {
    target: &'a IcpTarget,
}

impl<'a> NearestPoint<'a> {
    /// Matches with the points of `target`.
    pub fn new(target: &'a IcpTarget) -> Self {
        Self { target }
    }
}

impl PointMatching for NearestPoint<'_> {
    fn target(&self) -> TargetSurface<'_> {
        self.target.surface()
    }

    fn partner(&self, query: &Query) -> Partner {
        if !query.remember {
            let nearest = self.target.tree.any_nearest(&query.moved.into());
            return if nearest.distance_m <= query.limit_m {
                partner_at(self.target, nearest.index, 0.0)
            } else {
                Partner::none(0.0)
            };
        }
        let reach = BEYOND * query.limit_m;
        match self.target.tree.two_nearest(&query.moved.into(), reach) {
            None => Partner::none(reach - query.limit_m),
            Some((nearest, _)) if nearest.distance_m > query.limit_m => {
                Partner::none(nearest.distance_m - query.limit_m)
            }
            Some((nearest, second_m)) => partner_at(self.target, nearest.index, 0.5 * (second_m - nearest.distance_m)),
        }
    }
}

/// The point `index` of the target as partner.
pub(super) fn partner_at(target: &IcpTarget, index: usize, margin_m: f64) -> Partner {
    let (point, normal): (Vector3<f64>, _) = (target.cloud.points[index].coords, target.normals[index]);
    Partner { found: true, target: Some(index), point, normal, margin_m }
}
