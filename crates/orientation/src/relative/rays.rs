//! Image points, and the rays that they are.

use camera_model::{Camera, point_covariance};
use nalgebra::{Isometry3, Matrix3, Vector3};

use crate::{Error, Result};

/// Standard deviations of an angle beyond which rays that part (meet behind a camera) contradict a pose: one in 30,000.
const PARTING: f64 = 4.0;

/// An image point of a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImagePoint {
    /// Observed pixel position `(col, row)`, lens distortion included.
    pub pixel: [f64; 2],
    /// Standard deviations of the pixel position (column, row).
    pub sigma_pixel: [f64; 2],
}

impl ImagePoint {
    /// An image point with one standard deviation for both coordinates, pixel.
    pub fn new(pixel: [f64; 2], sigma_pixel: f64) -> Self {
        Self { pixel, sigma_pixel: [sigma_pixel; 2] }
    }
}

/// A ray in the camera frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ray {
    /// Unit vector towards the target.
    pub(crate) direction: Vector3<f64>,
    /// Its covariance, rank two.
    pub(crate) covariance: Matrix3<f64>,
}

impl Ray {
    pub(crate) fn new(camera: &Camera, seen: &ImagePoint, target: usize) -> Result<Self> {
        let refuse = |name, value, expected| Err(Error::InvalidTarget { target, name, value, expected });
        for (name, value) in [("col", seen.pixel[0]), ("row", seen.pixel[1])] {
            if !value.is_finite() {
                return refuse(name, value, "a coordinate is finite");
            }
        }
        for (name, value) in [("sigma_col", seen.sigma_pixel[0]), ("sigma_row", seen.sigma_pixel[1])] {
            if !(value > 0.0 && value.is_finite()) {
                return refuse(name, value, "a standard deviation is positive and finite");
            }
        }
        let direction = camera.ray(seen.pixel);
        let covariance = point_covariance(camera, seen.pixel, 1.0, 0.0, seen.sigma_pixel, None);
        let variance = covariance.trace();
        if !(direction.norm().is_finite() && variance.is_normal()) {
            return refuse("col", seen.pixel[0], "an image point has a ray of positive variance");
        }
        Ok(Self { direction, covariance })
    }
}

/// The rays of one target in two views.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair {
    pub(crate) first: Ray,
    pub(crate) second: Ray,
}

impl Pair {
    /// All pairs of two lists of image points that belong together.
    pub(crate) fn all(cameras: [&Camera; 2], views: [&[ImagePoint]; 2]) -> Result<Vec<Self>> {
        let [first, second] = views;
        if first.len() != second.len() {
            return Err(Error::LengthMismatch { first: first.len(), second: second.len() });
        }
        let pair = |(target, (a, b)): (usize, (&ImagePoint, &ImagePoint))| {
            Ok(Self { first: Ray::new(cameras[0], a, target)?, second: Ray::new(cameras[1], b, target)? })
        };
        first.iter().zip(second).enumerate().map(pair).collect()
    }

    /// Distances along both rays to where they are nearest to each other, times the square of the sine of their angle.
    pub(crate) fn depths(&self, first_from_second: &Isometry3<f64>) -> [f64; 2] {
        let (a, b) = (self.first.direction, first_from_second.rotation * self.second.direction);
        let base = first_from_second.translation.vector;
        let cosine = a.dot(&b);
        [a.dot(&base) - cosine * b.dot(&base), cosine * a.dot(&base) - b.dot(&base)]
    }

    /// Square of the sine of the angle at which the rays meet.
    pub(crate) fn sine_squared(&self, first_from_second: &Isometry3<f64>) -> f64 {
        self.first.direction.cross(&(first_from_second.rotation * self.second.direction)).norm_squared()
    }

    /// Angle at which the rays meet, in its standard deviations (or a little less).
    pub(crate) fn parallax(&self, first_from_second: &Isometry3<f64>) -> f64 {
        let variance = self.first.covariance.trace() + self.second.covariance.trace();
        (self.sine_squared(first_from_second) / variance).sqrt()
    }

    /// Whether the rays part instead of meeting, beyond what their errors explain.
    pub(crate) fn parts(&self, first_from_second: &Isometry3<f64>) -> bool {
        self.depths(first_from_second).iter().any(|depth| *depth < 0.0) && self.parallax(first_from_second) > PARTING
    }
}
