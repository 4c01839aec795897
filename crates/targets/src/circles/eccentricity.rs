//! The image of a circle's centre, which is not the centre of its ellipse.
//!
//! In the camera frame the rays `u` of the edge lie on the cone `uᵀ Q u = 0`. The centre of the circle lies on the ray `Q⁻¹ n`,
//! `n` the normal of its plane: the pole of the plane's vanishing line `[HartleyZisserman2004]`, exact at any size and tilt. With
//! the eigenvalues `λ1 ≥ λ2 > 0 > λ3` of Q and their vectors, the two planes that cut the cone in circles have the normals
//! `√((λ1−λ2)/(λ1−λ3)) v1 ± √((λ2−λ3)/(λ1−λ3)) v3`, and the radius gives the distance.

use camera_model::Camera;
use nalgebra::{Matrix2x5, Matrix3, Point3, SMatrix, SymmetricEigen, Vector3};

use super::ellipse::Ellipse;
use crate::error::{Error, Result};

/// Points of the ellipse that are taken through the lens.
const POINTS: usize = 24;
/// Step of the differences, pixel, and of the direction, radian: their error is its square.
const STEP: f64 = 1e-4;

/// The image of a circle's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CircleCentre {
    /// Pixel position, lens distortion included.
    pub pixel: [f64; 2],
    /// Its derivative by `[col, row, semi-major, semi-minor, direction]` of the ellipse, by central differences. Of a circle seen
    /// straight on the last column is of no use.
    pub by_ellipse: Matrix2x5<f64>,
}

/// A circle in space, camera frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CirclePose {
    /// Its centre, metre.
    pub centre: Point3<f64>,
    /// Unit normal of its plane, towards the camera.
    pub normal: Vector3<f64>,
}

/// The image of a circle's centre from its ellipse, where the normal of its plane is known (camera frame, any length and sign).
///
/// The edge is taken through the lens point by point; the rest is exact.
///
/// # Errors
/// [`Error::Invalid`] where ellipse and normal are those of no circle; [`Error::Camera`] for a camera that is not valid, or whose
/// lens has no image of the centre.
///
/// ```
/// use targets::camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
/// use targets::nalgebra::Vector3;
/// use targets::{Ellipse, centre_of_circle};
///
/// let format = ImageFormat::new(176, 144, [0.04, 0.04])?;
/// let interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 };
/// let camera = Camera::new(format, interior, LensDistortion::default())?;
/// // A circle of 40 pixels, tilted by 60° about the rows.
/// let ellipse = Ellipse { centre: [87.5, 71.5], semi_axes_px: [20.0, 10.0], direction_rad: 0.0 };
/// let normal = Vector3::new(0.0, 60_f64.to_radians().sin(), 60_f64.to_radians().cos());
/// let centre = centre_of_circle(&camera, &ellipse, &normal)?;
/// assert!((centre.pixel[1] - 71.5).abs() > 0.5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn centre_of_circle(camera: &Camera, ellipse: &Ellipse, normal: &Vector3<f64>) -> Result<CircleCentre> {
    camera.validate()?;
    let pixel = centre(camera, ellipse, normal)?;
    let mut by_ellipse = Matrix2x5::zeros();
    for column in 0..5 {
        let at = |sign: f64| centre(camera, &stepped(ellipse, column, sign * STEP), normal);
        let (above, below) = (at(1.0)?, at(-1.0)?);
        for row in 0..2 {
            by_ellipse[(row, column)] = (above[row] - below[row]) / (2.0 * STEP);
        }
    }
    Ok(CircleCentre { pixel, by_ellipse })
}

/// The two circles of a radius (metre) that a camera sees as an ellipse: one image does not tell which. Seen straight on they are
/// one.
///
/// # Errors
/// [`Error::Invalid`] for a radius that is not positive and an ellipse that is none.
pub fn poses_of_circle(camera: &Camera, ellipse: &Ellipse, radius_m: f64) -> Result<[CirclePose; 2]> {
    camera.validate()?;
    if !(radius_m.is_finite() && radius_m > 0.0) {
        let expected = "a radius is positive and finite";
        return Err(Error::Invalid { name: "radius_m", value: radius_m, expected });
    }
    let cone = cone(camera, ellipse)?;
    let eigen = SymmetricEigen::new(cone);
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let [first, second, third] = order.map(|k| eigen.eigenvalues[k]);
    let [v1, v3] = [order[0], order[2]].map(|k| eigen.eigenvectors.column(k).into_owned());
    let span = first - third;
    let [across, along] = [(first - second) / span, (second - third) / span].map(|square| square.max(0.0).sqrt());
    let pose = |sign: f64| {
        let normal = v1 * (sign * across) + v3 * along;
        let normal = if normal.dot(&camera.ray(ellipse.centre)) > 0.0 { -normal } else { normal };
        // In the plane nᵀ r = −d the cone leaves a circle about Q⁻¹ n; its radius at d = 1 by the quadratic form there.
        let inverse = cone.try_inverse()?;
        let pole = inverse * normal;
        let scale = normal.dot(&pole);
        let unit_centre = pole * (-1.0 / scale);
        let unit_square = -unit_centre.dot(&(cone * unit_centre)) / second;
        let centre = unit_centre * (radius_m / unit_square.sqrt());
        let good = centre.iter().all(|value| value.is_finite()) && centre.z < 0.0;
        good.then(|| CirclePose { centre: centre.into(), normal })
    };
    match (pose(1.0), pose(-1.0)) {
        (Some(a), Some(b)) => Ok([a, b]),
        _ => Err(no_circle(ellipse)),
    }
}

fn centre(camera: &Camera, ellipse: &Ellipse, normal: &Vector3<f64>) -> Result<[f64; 2]> {
    let inverse = cone(camera, ellipse)?.try_inverse().ok_or_else(|| no_circle(ellipse))?;
    let pole = inverse * normal;
    let ray = if pole.z > 0.0 { -pole } else { pole };
    if ray.z >= 0.0 || !ray.iter().all(|value| value.is_finite()) {
        return Err(Error::Invalid {
            name: "normal",
            value: normal.norm(),
            expected: "the normal of a plane that is not seen edge on",
        });
    }
    Ok(camera.project(&Point3::from(ray))?)
}

/// The cone of the rays of an ellipse's edge, positive outside: fitted to points that were taken through the lens.
fn cone(camera: &Camera, ellipse: &Ellipse) -> Result<Matrix3<f64>> {
    if !ellipse.semi_axes_px.iter().all(|axis| axis.is_finite() && *axis > 0.0) {
        return Err(no_circle(ellipse));
    }
    let rays = (0..POINTS).map(|k| camera.ray(ellipse.point(std::f64::consts::TAU * k as f64 / POINTS as f64)));
    // Plane coordinates about the middle ray, of size one: the conic is well conditioned there.
    let middle = camera.ray(ellipse.centre);
    let turn = nalgebra::Rotation3::rotation_between(&middle, &-Vector3::z()).ok_or_else(|| no_circle(ellipse))?;
    let points: Vec<[f64; 2]> = rays.map(|ray| turn * ray).map(|ray| [ray.x / ray.z, ray.y / ray.z]).collect();
    let size = points.iter().map(|[x, y]| x.hypot(*y)).sum::<f64>() / POINTS as f64;
    let mut normal = SMatrix::<f64, 6, 6>::zeros();
    for [x, y] in points.iter().map(|point| point.map(|value| value / size)) {
        let row = SMatrix::<f64, 6, 1>::from([x * x, 2.0 * x * y, y * y, 2.0 * x, 2.0 * y, 1.0]);
        normal += row * row.transpose();
    }
    if !normal.iter().all(|value| value.is_finite()) {
        return Err(no_circle(ellipse));
    }
    let eigen = SymmetricEigen::new(normal);
    let least = eigen.eigenvectors.column(eigen.eigenvalues.imin());
    let [a, b, c, d, e, f] = [0, 1, 2, 3, 4, 5].map(|k| least[k]);
    let conic = Matrix3::new(a, b, d, b, c, e, d, e, f);
    let scaled = Matrix3::from_diagonal(&Vector3::new(1.0 / size, 1.0 / size, 1.0));
    let cone = turn.matrix().transpose() * (scaled * conic * scaled) * turn.matrix();
    let sign = if a + c < 0.0 { -1.0 } else { 1.0 };
    // An ellipse: positive within the plane, and the middle inside.
    if a * c - b * b > 0.0 && f * sign < 0.0 { Ok(cone * sign) } else { Err(no_circle(ellipse)) }
}

fn no_circle(ellipse: &Ellipse) -> Error {
    let expected = "an ellipse before the camera";
    Error::Invalid { name: "semi_axes_px", value: ellipse.semi_axes_px[1], expected }
}

fn stepped(ellipse: &Ellipse, column: usize, step: f64) -> Ellipse {
    let mut moved = *ellipse;
    match column {
        0 | 1 => moved.centre[column] += step,
        2 | 3 => moved.semi_axes_px[column - 2] += step,
        _ => moved.direction_rad += step,
    }
    moved
}
