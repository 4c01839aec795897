//! Which point of the target a source point is paired with.

mod compatible;
mod nearest;
mod projective;

pub use compatible::CompatibleNearest;
pub use nearest::NearestPoint;
pub use projective::Projective;

use nalgebra::{Isometry3, Vector3};

use super::scene::TargetSurface;
use crate::error::Result;

/// Finds partners on a target. The matching owns, or borrows, the target: it alone knows what kind of thing that is.
pub trait PointMatching: Sync {
    /// The target's size and attributes.
    fn target(&self) -> TargetSurface<'_>;

    /// The partner of a source point at the pose of the query, within its limit.
    fn partner(&self, query: &Query) -> Partner;

    /// Refuses parameters outside their domain, and attributes that are needed and missing.
    fn validate(&self) -> Result<()> {
        Ok(())
    }
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
    /// The pose `target_from_source`.
    pub pose: Isometry3<f64>,
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
