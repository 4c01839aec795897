//! What all parts are shown: the two surfaces, the moment, the pairs.

use nalgebra::{Isometry3, Vector3};

use point_cloud::Cloud;

/// The two surfaces of a registration, and where it stands.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    /// The cloud that is moved, in its own frame.
    pub source: &'a Cloud,
    /// Its unit normals, given or estimated, one a point; NaN where a point has none.
    pub source_normals: &'a [Vector3<f64>],
    /// Whether at least half of the source points have a normal: they lie on surfaces and are no marks by themselves.
    pub is_surface: bool,
    /// What it is moved to.
    pub target: TargetSurface<'a>,
    /// Where the run stands.
    pub moment: Moment,
}

impl Scene<'_> {
    /// The same surfaces at another moment.
    #[must_use]
    pub fn at(&self, moment: Moment) -> Self {
        Self { moment, ..*self }
    }
}

/// What is known of a target besides its partners.
#[derive(Debug, Clone, Copy)]
pub struct TargetSurface<'a> {
    /// The points, where the target is a cloud.
    pub cloud: Option<&'a Cloud>,
    /// Root mean square distance of the surface from its centroid, metre.
    pub radius_m: f64,
    /// 90 % quantile of the distance between neighbouring points, metre; 0 for a surface without gaps.
    pub spacing_m: f64,
    /// Whether the normals are free of noise, as those of a model are.
    pub exact_normals: bool,
}

impl TargetSurface<'_> {
    /// Distance limit of the last level, metre: three times the spacing; a fiftieth of the radius of a surface without
    /// gaps.
    pub(crate) fn default_limit_m(&self) -> f64 {
        if self.spacing_m > 0.0 {
            return 3.0 * self.spacing_m;
        }
        let part = if self.cloud.is_none() { 50.0 } else { 1.0 };
        (self.radius_m / part).max(f64::MIN_POSITIVE)
    }
}

/// Where a run stands when a part is asked.
#[derive(Debug, Clone, Copy)]
pub struct Moment {
    /// The pose `target_from_source`.
    pub pose: Isometry3<f64>,
    /// Largest distance of a pair, metre.
    pub limit_m: f64,
    /// Whether the run has ended and the pose is only being judged.
    pub ended: bool,
}

/// A source point and its partner on the target; vectors in the target frame, metre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Index of the source point.
    pub source: usize,
    /// Index of the target point, where the target is a cloud.
    pub target: Option<usize>,
    /// The source point at the pose of the moment.
    pub moved: Vector3<f64>,
    /// Its normal at that pose, turned to the side of the target's; NaN where there is none.
    pub source_normal: Vector3<f64>,
    /// The partner.
    pub point: Vector3<f64>,
    /// Unit normal of the target there; NaN where there is none.
    pub normal: Vector3<f64>,
    /// Distance of the two, metre.
    pub distance_m: f64,
    /// Precision of the pair relative to others, 1/σ² where sigmas are known; 1 at first.
    pub weight: f64,
}

impl Pair {
    /// From the partner to the source point, metre.
    pub fn offset(&self) -> Vector3<f64> {
        self.moved - self.point
    }

    /// Whether both points have a normal.
    pub fn has_normals(&self) -> bool {
        !(self.normal.x.is_nan() || self.source_normal.x.is_nan())
    }
}
