//! A target, what was observed of it, and what is refused.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::{Error, Result};

/// Targets that a resection needs: each image point gives two of the six unknowns.
pub(crate) const NEEDED: usize = 3;

/// Extent across a line over extent along it below which targets count as collinear: the turn about the line would
/// come out of rounding.
const COLLINEAR_RATIO: f64 = 1e-6;

/// One target with its coordinates, its image point and, where there is one, its range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetObservation {
    /// Coordinates in the world frame, metre.
    pub point: Point3<f64>,
    /// Covariance of the coordinates, square metre; `None` where they are taken as free of error.
    pub point_covariance: Option<Matrix3<f64>>,
    /// Observed pixel position `(col, row)`, lens distortion included.
    pub pixel: [f64; 2],
    /// Standard deviations of the pixel position (column, row).
    pub sigma_pixel: [f64; 2],
    /// Observed range, if any.
    pub range: Option<ObservedRange>,
}

/// A range with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObservedRange {
    /// Distance from the perspective centre, corrected for range errors, metre.
    pub range_m: f64,
    /// Standard deviation, metre.
    pub sigma_m: f64,
}

impl TargetObservation {
    /// A target with coordinates free of error (metre) and an image point (pixel, one deviation for both coordinates).
    pub fn new(point: Point3<f64>, pixel: [f64; 2], sigma_pixel: f64) -> Self {
        Self { point, point_covariance: None, pixel, sigma_pixel: [sigma_pixel; 2], range: None }
    }

    /// The same target with a range and its standard deviation, metre.
    #[must_use]
    pub fn with_range(self, range_m: f64, sigma_m: f64) -> Self {
        Self { range: Some(ObservedRange { range_m, sigma_m }), ..self }
    }

    /// The same target with a covariance of its coordinates, square metre.
    #[must_use]
    pub fn with_point_covariance(self, covariance: Matrix3<f64>) -> Self {
        Self { point_covariance: Some(covariance), ..self }
    }

    fn check(&self, target: usize) -> Result<()> {
        let refuse = |name, value, expected| Err(Error::InvalidTarget { target, name, value, expected });
        let finite = [("x", self.point.x), ("y", self.point.y), ("z", self.point.z)];
        for (name, value) in finite.into_iter().chain([("col", self.pixel[0]), ("row", self.pixel[1])]) {
            if !value.is_finite() {
                return refuse(name, value, "a coordinate is finite");
            }
        }
        let range = self.range.map_or([1.0, 1.0], |range| [range.range_m, range.sigma_m]);
        let positive = [
            ("sigma_col", self.sigma_pixel[0]),
            ("sigma_row", self.sigma_pixel[1]),
            ("range", range[0]),
            ("sigma_range", range[1]),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return refuse(name, value, "a range or a standard deviation is positive and finite");
            }
        }
        Ok(())
    }
}

/// Fails unless the targets can orient a station at all.
pub(crate) fn check(targets: &[TargetObservation]) -> Result<()> {
    for (index, target) in targets.iter().enumerate() {
        target.check(index)?;
    }
    if targets.len() < NEEDED {
        return Err(Error::TooFewTargets { found: targets.len(), needed: NEEDED });
    }
    let points: Vec<_> = targets.iter().map(|target| target.point).collect();
    let ratio = spread_ratio(&points);
    if ratio < COLLINEAR_RATIO { Err(Error::CollinearTargets { ratio }) } else { Ok(()) }
}

/// Second over first principal extent of some points; zero for one point alone.
pub(crate) fn spread_ratio(points: &[Point3<f64>]) -> f64 {
    let mean = points.iter().map(|point| point.coords).sum::<Vector3<f64>>() / points.len() as f64;
    // The longest vector from the mean is a direction of the line, if there is one; what is across it is measured.
    let longest = points.iter().map(|point| point.coords - mean).fold(Vector3::zeros(), |longest, offset| {
        if offset.norm_squared() > longest.norm_squared() { offset } else { longest }
    });
    let length = longest.norm();
    if length <= 0.0 {
        return 0.0;
    }
    let along = longest / length;
    let across = points.iter().map(|point| (point.coords - mean).cross(&along).norm()).fold(0.0, f64::max);
    across / length
}
