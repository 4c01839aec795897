//! Which point of the target a source point is paired with.

use nalgebra::Vector3;

use super::scene::TargetSurface;
use crate::target::IcpTarget;

/// Finds partners on a target. The matching owns, or borrows, the target: it alone knows what kind of thing that is.
pub trait PointMatching: Sync {
    /// The target's size and attributes.
    fn target(&self) -> TargetSurface<'_>;

    /// The partner of a source point at the pose of the query, within its limit.
    fn partner(&self, query: &Query) -> Partner;
}

/// A source point that looks for a partner; vectors in the target frame, metre. The point is finite.
#[derive(Debug, Clone, Copy)]
pub struct Query {
    /// Index of the source point.
    pub source: usize,
    /// The source point at the pose.
    pub moved: Vector3<f64>,
    /// Its normal at the pose; NaN where there is none.
    pub normal: Vector3<f64>,
    /// Partners farther away are of no use, metre.
    pub limit_m: f64,
    /// Whether the point will be asked about again nearby, so that [`Partner::margin_m`] is worth some effort.
    pub remember: bool,
}

/// The answer to a [`Query`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Partner {
    /// Whether there is one.
    pub found: bool,
    /// Index of the target point, where the target is a cloud.
    pub target: Option<usize>,
    /// The partner, metre.
    pub point: Vector3<f64>,
    /// Unit normal there; NaN where there is none.
    pub normal: Vector3<f64>,
    /// How far the source point may move without the answer changing, metre: the point is not asked about again before.
    /// Zero where that is not known.
    pub margin_m: f64,
}

impl Partner {
    /// No partner, and none within the limit before the point has moved by `margin_m`.
    pub fn none(margin_m: f64) -> Self {
        let nothing = Vector3::repeat(f64::NAN);
        Self { found: false, target: None, point: nothing, normal: nothing, margin_m }
    }
}

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
fn partner_at(target: &IcpTarget, index: usize, margin_m: f64) -> Partner {
    let (point, normal): (Vector3<f64>, _) = (target.cloud.points[index].coords, target.normals[index]);
    Partner { found: true, target: Some(index), point, normal, margin_m }
}
