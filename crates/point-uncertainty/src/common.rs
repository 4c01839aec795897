//! Errors that many points have in common: names, sources, one covariance matrix.

use std::collections::BTreeSet;

use nalgebra::DMatrix;

use crate::{Error, Result};

/// Correlations may exceed one by this much: matrices come from files with rounded numbers.
const ROUNDING: f64 = 1e-6;

/// Where an error comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Source {
    /// Random error of a point's range: no other point has it.
    Noise,
    /// Systematic part that neighbouring pixels of one frame share.
    Sensor,
    /// Range terms, lens, interior orientation, and what else all frames of a sensor share.
    Calibration,
    /// Drift of a warming camera: common to a frame.
    Drift,
    /// Pose of a station: common to what it saw.
    Pose,
}

impl Source {
    /// All sources, from the photon to the cloud.
    pub const ALL: [Self; 5] = [Self::Noise, Self::Sensor, Self::Calibration, Self::Drift, Self::Pose];

    /// The name in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Noise => "noise",
            Self::Sensor => "sensor",
            Self::Calibration => "calibration",
            Self::Drift => "drift",
            Self::Pose => "poses",
        }
    }
}

/// One error that many points have in common.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CommonError {
    /// Its name: that of a parameter (`d0`), or station and component (`S03 dx`).
    pub name: String,
    /// Where it comes from.
    pub source: Source,
}

/// All errors that points have in common, with their covariance.
#[derive(Debug, Clone, PartialEq)]
pub struct CommonErrors {
    errors: Vec<CommonError>,
    covariance: DMatrix<f64>,
}

impl CommonErrors {
    /// Errors with their covariance matrix, each in its unit (that of a parameter; metre and radian of a pose).
    ///
    /// # Errors
    /// [`Error::Size`], [`Error::DuplicateName`]; [`Error::Covariance`] where the matrix is not finite, not symmetric, has a negative
    /// variance, or a covariance above the product of the two deviations.
    pub fn new(errors: Vec<CommonError>, mut covariance: DMatrix<f64>) -> Result<Self> {
        let (rows, columns) = covariance.shape();
        if rows != errors.len() || columns != errors.len() {
            return Err(Error::Size { errors: errors.len(), rows, columns });
        }
        let mut names = BTreeSet::new();
        if let Some(twice) = errors.iter().find(|error| !names.insert(error.name.as_str())) {
            return Err(Error::DuplicateName(twice.name.clone()));
        }
        for row in 0..rows {
            for column in 0..=row {
                let wrong = wrong_entry(&covariance, row, column);
                if let Some(expected) = wrong {
                    let [first, second] = [row, column].map(|at| errors[at].name.clone());
                    return Err(Error::Covariance { first, second, value: covariance[(row, column)], expected });
                }
                let mean = 0.5 * (covariance[(row, column)] + covariance[(column, row)]);
                covariance[(row, column)] = mean;
                covariance[(column, row)] = mean;
            }
        }
        Ok(Self { errors, covariance })
    }

    /// Nothing in common.
    pub fn none() -> Self {
        Self { errors: Vec::new(), covariance: DMatrix::zeros(0, 0) }
    }

    /// The errors, in the order of the rows.
    pub fn errors(&self) -> &[CommonError] {
        &self.errors
    }

    /// Their covariance.
    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    /// The same with errors of one source known without error: what leaving it out would state.
    #[must_use]
    pub fn without(&self, source: Source) -> Self {
        let kept = |at: usize| self.errors[at].source != source;
        let size = self.errors.len();
        let entry = |row, column| if kept(row) && kept(column) { self.covariance[(row, column)] } else { 0.0 };
        Self { errors: self.errors.clone(), covariance: DMatrix::from_fn(size, size, entry) }
    }
}

/// What an entry should be, where it is not.
fn wrong_entry(covariance: &DMatrix<f64>, row: usize, column: usize) -> Option<&'static str> {
    let value = covariance[(row, column)];
    let scale = (covariance[(row, row)] * covariance[(column, column)]).sqrt();
    if !value.is_finite() {
        Some("it must be finite")
    } else if row == column && value < 0.0 {
        Some("a variance is not negative")
    } else if (value - covariance[(column, row)]).abs() > ROUNDING * scale.max(f64::MIN_POSITIVE) {
        Some("it must be that of the second and the first")
    } else if value.abs() > (1.0 + ROUNDING) * scale {
        Some("it may not exceed the product of their deviations")
    } else {
        None
    }
}
