//! Which differences of two calibrations are significant: parameters, the corrections that they make, the image.

mod correction;
mod drift;
mod image;
mod parameters;

pub use correction::{CorrectionComparison, CorrectionDifference, CorrectionSide, compare_corrections};
pub use drift::{DriftComparison, DriftDifference, DriftSide, compare_drifts};
pub use image::{ImageComparison, ImageSide, compare_images};
pub use parameters::{JointTest, ParameterComparison, ParameterDifference, ParameterSet, compare_parameters};

use nalgebra::DMatrix;
use statistics::Distribution;

use crate::{Error, Result};

/// Refuses a level that is no probability.
fn require_level(level: f64) -> Result<()> {
    if level > 0.0 && level < 1.0 {
        return Ok(());
    }
    Err(Error::OutOfDomain { name: "level", value: level, expected: "a probability between 0 and 1" })
}

/// Refuses a covariance of another size than there are parameters, and one that is none.
fn require_covariance(covariance: &DMatrix<f64>, parameters: usize) -> Result<()> {
    let refuse = |value, expected| Err(Error::OutOfDomain { name: "covariance", value, expected });
    if covariance.shape() != (parameters, parameters) {
        return refuse(covariance.nrows() as f64, "one row and column a parameter");
    }
    match covariance.iter().find(|value| !value.is_finite()) {
        Some(&value) => refuse(value, "finite numbers"),
        None => match covariance.diagonal().iter().find(|variance| **variance < 0.0) {
            Some(&variance) => refuse(variance, "variances that are not negative"),
            None => Ok(()),
        },
    }
}

/// Multiples of the standard deviation that hold for all points of a function of so many parameters at once `[Scheffe1953]`.
fn simultaneous_factor(parameters: usize, level: f64) -> f64 {
    if parameters == 0 { 0.0 } else { Distribution::ChiSquared { dof: parameters as f64 }.critical(level).sqrt() }
}

/// Names of parameters that have a variance in at least one of two sets. To first order a difference of functions is one of
/// the differences of their parameters: a name counts once.
fn estimated(sides: [(&[String], &DMatrix<f64>); 2]) -> usize {
    let mut found: Vec<&String> = Vec::new();
    for (names, covariance) in sides {
        for (index, name) in names.iter().enumerate() {
            if covariance[(index, index)] > 0.0 && !found.contains(&name) {
                found.push(name);
            }
        }
    }
    found.len()
}

/// Standard deviation of a linear function of parameters.
fn deviation(covariance: &DMatrix<f64>, gradient: &[f64]) -> f64 {
    let mut sum = 0.0;
    for (i, left) in gradient.iter().enumerate() {
        for (j, right) in gradient.iter().enumerate() {
            sum += left * covariance[(i, j)] * right;
        }
    }
    sum.max(0.0).sqrt()
}
