//! The range of a primitive along a ray, and its derivatives.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::Primitive;

/// A primitive with the parameters of its adjustment:
/// - plane: `m = n / d`, so that `mᵀ r = 1`;
/// - sphere: centre and radius;
/// - cylinder: two slopes of the axis against a frame that is held, two coordinates across it, radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Surface {
    Plane,
    /// `far`: whether rays are taken where they leave the sphere.
    Sphere {
        far: bool,
    },
    Cylinder {
        far: bool,
        /// Across, across, along.
        frame: Matrix3<f64>,
        /// Place of the region along the third axis, metre.
        along_m: f64,
    },
}

/// Range along a unit ray, cosine of the angle of incidence, and the derivatives of the range, as many as parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    pub(crate) range_m: f64,
    pub(crate) cosine: f64,
    pub(crate) derivatives: [f64; 5],
}

impl Surface {
    /// `None` where the ray misses the surface or the parameters are those of none.
    pub(crate) fn hit(&self, parameters: &[f64], ray: &Vector3<f64>) -> Option<Hit> {
        let hit = match (self, parameters) {
            (Self::Plane, &[a, b, c]) => plane(Vector3::new(a, b, c), ray),
            (Self::Sphere { far }, &[x, y, z, radius]) => sphere(Vector3::new(x, y, z), radius, *far, ray),
            (Self::Cylinder { far, frame, along_m }, &[.., radius]) if parameters.len() == 5 => {
                let slopes = [parameters[0], parameters[1]];
                let place = frame * Vector3::new(parameters[2], parameters[3], *along_m);
                cylinder(frame, slopes, place, radius, *far, ray)
            }
            _ => None,
        };
        hit.filter(|hit| hit.range_m > 0.0 && hit.range_m.is_finite() && hit.derivatives.iter().all(|d| d.is_finite()))
    }

    /// The primitive that parameters stand for.
    pub(crate) fn primitive(&self, parameters: &[f64]) -> Option<Primitive> {
        match (self, parameters) {
            (Self::Plane, &[a, b, c]) => {
                let m = Vector3::new(a, b, c);
                Some(Primitive::Plane { normal: m.normalize(), distance_m: m.norm().recip() })
            }
            (Self::Sphere { .. }, &[x, y, z, radius_m]) => {
                Some(Primitive::Sphere { centre: Point3::new(x, y, z), radius_m })
            }
            (Self::Cylinder { frame, along_m, .. }, &[a, b, x, y, radius_m]) => {
                let point = Point3::from(frame * Vector3::new(x, y, *along_m));
                Some(Primitive::Cylinder { point, axis: axis(frame, [a, b]).0, radius_m })
            }
            _ => None,
        }
    }
}

fn plane(m: Vector3<f64>, ray: &Vector3<f64>) -> Option<Hit> {
    let slope = m.dot(ray);
    let range_m = slope.recip();
    let d = ray * -(range_m * range_m);
    (slope > 0.0).then(|| Hit { range_m, cosine: slope / m.norm(), derivatives: [d.x, d.y, d.z, 0.0, 0.0] })
}

/// With `q = ρ u − c`, `|q|² = R²`: `dρ = (qᵀ dc + R dR) / qᵀ u`.
fn sphere(centre: Vector3<f64>, radius: f64, far: bool, ray: &Vector3<f64>) -> Option<Hit> {
    let along = ray.dot(&centre);
    let root = (along * along - centre.norm_squared() + radius * radius).sqrt();
    let range_m = if far { along + root } else { along - root };
    let q = ray * range_m - centre;
    let across = q.dot(ray);
    let d = q / across;
    (radius > 0.0 && root > 0.0).then(|| Hit {
        range_m,
        cosine: (across / radius).abs(),
        derivatives: [d.x, d.y, d.z, radius / across, 0.0],
    })
}

/// Unit axis and its derivatives by the two slopes.
fn axis(frame: &Matrix3<f64>, [a, b]: [f64; 2]) -> (Vector3<f64>, [Vector3<f64>; 2]) {
    let long = frame * Vector3::new(a, b, 1.0);
    let (unit, length) = (long.normalize(), long.norm());
    let derivative = |column: usize| {
        let step = frame.column(column).into_owned();
        (step - unit * unit.dot(&step)) / length
    };
    (unit, [derivative(0), derivative(1)])
}

/// With `d = ρ u − c`, `q = d − a (aᵀ d)`, `|q|² = R²`: `dρ = (qᵀ dc + (aᵀ d) qᵀ da + R dR) / qᵀ u`.
fn cylinder(
    frame: &Matrix3<f64>,
    slopes: [f64; 2],
    place: Vector3<f64>,
    radius: f64,
    far: bool,
    ray: &Vector3<f64>,
) -> Option<Hit> {
    let (axis, by_slopes) = axis(frame, slopes);
    let across = |v: &Vector3<f64>| v - axis * axis.dot(v);
    let (w, e) = (across(ray), across(&place));
    let (square, half) = (w.norm_squared(), w.dot(&e));
    let root = (half * half - square * (e.norm_squared() - radius * radius)).sqrt();
    let range_m = if far { half + root } else { half - root } / square;
    let q = w * range_m - e;
    let slope = q.dot(&w);
    let along = axis.dot(&(ray * range_m - place));
    let by_place = |column: usize| q.dot(&frame.column(column)) / slope;
    let by_slope = |column: usize| along * q.dot(&by_slopes[column]) / slope;
    (radius > 0.0 && root > 0.0).then(|| Hit {
        range_m,
        cosine: (slope / radius).abs(),
        derivatives: [by_slope(0), by_slope(1), by_place(0), by_place(1), radius / slope],
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use approx::assert_relative_eq;
    use nalgebra::Rotation3;

    use super::*;

    fn cases() -> Vec<(Surface, Vec<f64>)> {
        let frame = Rotation3::from_euler_angles(1.3, -0.2, 0.9).into_inner();
        let middle = frame.tr_mul(&Vector3::new(0.1, -0.05, -2.0));
        let mut out = vec![(Surface::Plane, vec![0.05, -0.03, -0.4])];
        for far in [false, true] {
            out.push((Surface::Sphere { far }, vec![0.1, -0.05, -2.0, 0.5]));
            out.push((Surface::Cylinder { far, frame, along_m: middle.z }, vec![0.02, -0.05, middle.x, middle.y, 0.5]));
        }
        out
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        for ray in [Vector3::new(0.02, 0.05, -1.0), Vector3::new(-0.04, 0.1, -1.0)].map(|ray| ray.normalize()) {
            for (surface, parameters) in cases() {
                let hit = surface.hit(&parameters, &ray).unwrap();
                for index in 0..parameters.len() {
                    let step = 1e-6;
                    let at = |sign: f64| {
                        let mut moved = parameters.clone();
                        moved[index] += sign * step;
                        surface.hit(&moved, &ray).unwrap().range_m
                    };
                    let difference = (at(1.0) - at(-1.0)) / (2.0 * step);
                    // Ranges of metres are rounded to 4e-16, which is 2e-10 of the difference; curvature adds step².
                    assert_relative_eq!(hit.derivatives[index], difference, max_relative = 1e-6, epsilon = 1e-8);
                }
            }
        }
    }

    #[test]
    fn points_lie_on_the_primitive() {
        let ray = Vector3::new(0.02, 0.05, -1.0).normalize();
        for (surface, parameters) in cases() {
            let hit = surface.hit(&parameters, &ray).unwrap();
            let point = Point3::from(ray * hit.range_m);
            let off = match surface.primitive(&parameters).unwrap() {
                Primitive::Plane { normal, distance_m } => normal.dot(&point.coords) - distance_m,
                Primitive::Sphere { centre, radius_m } => (point - centre).norm() - radius_m,
                Primitive::Cylinder { point: foot, axis, radius_m } => axis.cross(&(point - foot)).norm() - radius_m,
            };
            assert!(off.abs() < 1e-12, "{surface:?}: {off}");
        }
    }

    #[test]
    fn rays_that_miss_have_no_range() {
        let ray = Vector3::new(0.9, 0.0, -0.4).normalize();
        for (surface, parameters) in &cases()[1..] {
            assert!(surface.hit(parameters, &ray).is_none_or(|hit| hit.range_m > 0.0));
        }
        assert!(Surface::Plane.hit(&[0.0, 0.0, 0.4], &-Vector3::z()).is_none(), "behind the camera");
        assert!(Surface::Plane.hit(&[0.0, 0.0], &-Vector3::z()).is_none(), "too few parameters");
    }
}
