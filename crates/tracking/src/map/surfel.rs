//! One point of a map.

use nalgebra::{Point3, Vector3};
use point_cloud::SAME_SURFACE_COSINE;

/// A point of a surface as it was observed, or the weighted mean of several.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Surfel {
    pub(crate) position: Point3<f64>,
    /// Sum of the weighted unit normals.
    pub(super) normal: Vector3<f64>,
    pub(super) weight: f64,
    /// Sum of squared weights times variances of what is independent.
    pub(super) noise: f64,
    /// Sum of weights times standard deviations of what all points have in common.
    pub(super) common: f64,
    /// The next one of its voxel.
    pub(crate) next: Option<u32>,
}

impl Surfel {
    /// A point with its unit normal; standard deviations along the normal, by noise and by the pose. `None` where they are none.
    pub(crate) fn new(position: Point3<f64>, normal: Vector3<f64>, noise_m: f64, pose_m: f64) -> Option<Self> {
        let weight = 1.0 / (noise_m * noise_m + pose_m * pose_m);
        let sound = weight.is_finite() && weight > 0.0 && noise_m > 0.0;
        let finite = position.iter().chain(normal.iter()).all(|value| value.is_finite());
        (sound && finite).then(|| Self {
            position,
            normal: normal * weight,
            weight,
            noise: (weight * noise_m).powi(2),
            common: weight * pose_m,
            next: None,
        })
    }

    /// Whether another lies on the same side of the same surface, seen from its voxel.
    pub(crate) fn is_alike(&self, other: &Self) -> bool {
        self.normal.dot(&other.normal) >= SAME_SURFACE_COSINE * self.normal.norm() * other.normal.norm()
    }

    /// The weighted mean of both.
    pub(crate) fn join(&mut self, other: &Self) {
        self.weight += other.weight;
        self.position += (other.position - self.position) * (other.weight / self.weight);
        self.normal += other.normal;
        self.noise += other.noise;
        self.common += other.common;
    }

    pub(crate) fn unit_normal(&self) -> Vector3<f64> {
        self.normal.try_normalize(0.0).unwrap_or_else(|| Vector3::repeat(f64::NAN))
    }

    /// Standard deviation along the normal: noise as it averages out, the poses' part as it does not.
    pub(crate) fn sigma_m(&self) -> f64 {
        (self.noise + self.common * self.common).sqrt() / self.weight
    }
}
