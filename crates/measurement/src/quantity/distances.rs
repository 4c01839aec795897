//! Distances between places, planes and axes.

use nalgebra::{Point3, Vector3};

use super::{Place, Quantity, Unit, angle, sum};
use crate::region::across;
use crate::{Cloud, Error, FittedCylinder, FittedPlane, Result};

/// Largest angle between planes that are said to have a distance, radian: there it changes by a tenth of the way along them, and is
/// one number no more. Larger gives distances that hold at one place alone.
const LARGEST_ANGLE_RAD: f64 = 0.1;

/// Distance of two places: points, means, centres of spheres.
pub fn point_distance(first: &Place, second: &Place) -> Quantity {
    let way = second.position - first.position;
    let value = way.norm();
    let along = way.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(Vector3::z);
    let by = |direction: &Vector3<f64>| sum(&[(&second.along(direction), 1.0), (&first.along(direction), -1.0)]);
    let across = across(&along).iter().map(by).collect();
    Quantity { value, unit: Unit::Metre, gradient: by(&along), across }
}

/// Distance of a place from a plane, positive on the side that the normal points to.
pub fn plane_distance(place: &Place, plane: &FittedPlane) -> Quantity {
    let normal = plane.normal.into_inner();
    let way = place.position - plane.point;
    let of_plane = plane.support.gradient(&plane.by_tilt(&way, -1.0));
    Quantity::new(normal.dot(&way), Unit::Metre, sum(&[(&place.along(&normal), 1.0), (&of_plane, 1.0)]))
}

/// Distance of a place from the axis of a cylinder.
pub fn axis_distance(place: &Place, cylinder: &FittedCylinder) -> Quantity {
    let axis = cylinder.axis.into_inner();
    let way = place.position - cylinder.point;
    let along_m = axis.dot(&way);
    let offset = way - axis * along_m;
    let outward = offset.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(|| across(&axis)[0]);
    let by = |direction: &Vector3<f64>| {
        let of_axis = cylinder.support.gradient(&cylinder.by_place(direction, along_m));
        sum(&[(&place.along(direction), 1.0), (&of_axis, -1.0)])
    };
    let aside = axis.cross(&outward);
    Quantity { value: offset.norm(), unit: Unit::Metre, gradient: by(&outward), across: vec![by(&aside)] }
}

/// The distance of two nearly parallel planes.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneDistance {
    /// The distance along the mean normal, taken at [`at`](Self::at).
    pub distance: Quantity,
    /// Angle between the planes.
    pub angle: Quantity,
    /// Where the distance is taken.
    pub at: Point3<f64>,
    /// How much it changes from there to the furthest point of either region, metre.
    pub change_m: f64,
}

/// Distance of two nearly parallel planes along their mean normal, in the middle between their regions, or at a given place.
///
/// # Errors
/// [`Error::NotParallel`].
pub fn plane_to_plane(
    cloud: &Cloud<'_>,
    first: &FittedPlane,
    second: &FittedPlane,
    at: Option<Point3<f64>>,
) -> Result<PlaneDistance> {
    let angle = angle(&first.direction(), &second.direction());
    if angle.value > LARGEST_ANGLE_RAD {
        let [angle_deg, limit_deg] = [angle.value, LARGEST_ANGLE_RAD].map(f64::to_degrees);
        return Err(Error::NotParallel { angle_deg, limit_deg });
    }
    let at = at.unwrap_or_else(|| nalgebra::center(&first.point, &second.point));
    let normals = [first.normal.into_inner(), second.normal.into_inner()];
    let flip = if normals[0].dot(&normals[1]) < 0.0 { -1.0 } else { 1.0 };
    let both = normals[0] + normals[1] * flip;
    let mean = both.normalize();
    // Each plane met from `at` along the mean normal.
    let meet = |plane: &FittedPlane| plane.normal.dot(&(plane.point - at)) / plane.normal.dot(&mean);
    let ways = [meet(first), meet(second)];
    let signed = ways[1] - ways[0];
    let sense = if signed < 0.0 { -1.0 } else { 1.0 };
    // Derivatives of the signed distance by the mean normal, which moves with both.
    let by_normal = |way: f64, normal: &Vector3<f64>| normal * (way / normal.dot(&mean));
    let by_mean = by_normal(ways[0], &normals[0]) - by_normal(ways[1], &normals[1]);
    let by_mean = (by_mean - mean * mean.dot(&by_mean)) / both.norm();
    let of = |plane: &FittedPlane, way: f64, sign: f64, own: f64| {
        let slope = plane.normal.dot(&mean);
        let met = at + mean * way;
        let tilt = (met - plane.point) * (-sign / slope) + by_mean * own;
        plane.support.gradient(&plane.by_tilt(&tilt, sign / slope))
    };
    let gradient = sum(&[(&of(first, ways[0], -1.0, 1.0), sense), (&of(second, ways[1], 1.0, flip), sense)]);
    let reach = furthest(cloud, first, at, &mean).max(furthest(cloud, second, at, &mean));
    let distance = Quantity::new(signed.abs(), Unit::Metre, gradient);
    Ok(PlaneDistance { distance, change_m: reach * angle.value.tan(), angle, at })
}

/// Longest way along the plane from a place to a point that it was fitted to, metre.
fn furthest(cloud: &Cloud<'_>, plane: &FittedPlane, at: Point3<f64>, normal: &Vector3<f64>) -> f64 {
    let ways = plane.support.kept.iter().filter_map(|index| cloud.points.get(*index));
    ways.map(|point| (point - at).cross(normal).norm()).fold(0.0, f64::max)
}
