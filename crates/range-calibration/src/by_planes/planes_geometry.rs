//! A plane with three unknowns, and the range to it.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::{Plane, Result};

/// A plane through the neighbourhood of a point: two tilts (radian) about it and a distance (metre) from it. At the
/// middle of what was seen of a plane these three hardly share their effect.
#[derive(Debug, Clone)]
pub(crate) struct PlaneChart {
    normal: Vector3<f64>,
    axes: [Vector3<f64>; 2],
    middle: Vector3<f64>,
}

/// A range to a plane and its derivatives.
pub(crate) struct RangeToPlane {
    pub(crate) range_m: f64,
    /// By tilts and distance.
    pub(crate) by_plane: [f64; 3],
    /// By the pose's tangent step `[dt world, dθ camera]`.
    pub(crate) by_pose: [f64; 6],
}

impl PlaneChart {
    /// The chart whose zero is `plane`, about its point nearest to `middle`.
    pub(crate) fn new(plane: &Plane, middle: &Point3<f64>) -> Self {
        let normal = plane.normal();
        let middle = middle.coords + normal * (plane.distance_m() - normal.dot(&middle.coords));
        // The axis least like the normal gives a well-conditioned cross product.
        let first = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
        Self { normal, axes: [first, normal.cross(&first)], middle }
    }

    /// The plane of three unknowns.
    pub(crate) fn plane(&self, unknowns: &[f64]) -> Result<Plane> {
        let (normal, _) = self.normal_at(unknowns);
        Ok(Plane::new(&normal, &Point3::from(self.middle + normal * unknowns[2]))?)
    }

    /// Unit normal and the length of the vector it was scaled from.
    fn normal_at(&self, unknowns: &[f64]) -> (Vector3<f64>, f64) {
        let tilted = self.normal + self.axes[0] * unknowns[0] + self.axes[1] * unknowns[1];
        let length = tilted.norm();
        (tilted / length, length)
    }

    /// Range along rays from a pose, with derivatives.
    pub(crate) fn seen_from(
        &self,
        unknowns: &[f64],
        world_from_camera: &Isometry3<f64>,
    ) -> impl Fn(&Vector3<f64>) -> Option<RangeToPlane> + use<> {
        let (normal, length) = self.normal_at(unknowns);
        let tangents = self.axes.map(|axis| (axis - normal * normal.dot(&axis)) / length);
        // All vectors in camera axes, from the perspective centre.
        let rotation = world_from_camera.rotation.inverse();
        let centre = world_from_camera.translation.vector;
        let height = normal.dot(&(self.middle - centre)) + unknowns[2];
        let (to_middle, normal_world) = (rotation * (self.middle - centre), normal);
        let (normal, tangents) = (rotation * normal, tangents.map(|tangent| rotation * tangent));
        move |ray| {
            let slope = normal.dot(ray);
            let range_m = height / slope;
            if !(range_m > 0.0 && range_m.is_finite()) {
                return None;
            }
            let off_middle = ray * range_m - to_middle;
            let turn = ray.cross(&normal) * (-range_m / slope);
            let shift = normal_world / -slope;
            Some(RangeToPlane {
                range_m,
                by_plane: [-tangents[0].dot(&off_middle) / slope, -tangents[1].dot(&off_middle) / slope, 1.0 / slope],
                by_pose: [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z],
            })
        }
    }
}
