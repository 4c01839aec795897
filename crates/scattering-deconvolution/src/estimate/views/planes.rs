//! Pairs of matrices: real and imaginary part.

use nalgebra::DMatrix;

/// A complex image, columns along the first index. Stored column-major, it is row by row in memory.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::estimate) struct Planes {
    pub(in crate::estimate) real: DMatrix<f64>,
    pub(in crate::estimate) imaginary: DMatrix<f64>,
}

impl Planes {
    pub(in crate::estimate) fn zeros([columns, rows]: [usize; 2]) -> Self {
        Self { real: DMatrix::zeros(columns, rows), imaginary: DMatrix::zeros(columns, rows) }
    }

    /// The same linear map of both parts.
    pub(in crate::estimate) fn map(&self, map: impl Fn(&DMatrix<f64>) -> DMatrix<f64>) -> Self {
        Self { real: map(&self.real), imaginary: map(&self.imaginary) }
    }

    /// Adds a multiple.
    pub(in crate::estimate) fn add(&mut self, factor: f64, other: &Self) {
        for (own, other) in [(&mut self.real, &other.real), (&mut self.imaginary, &other.imaginary)] {
            own.zip_apply(other, |own, other| *own += factor * other);
        }
    }

    pub(in crate::estimate) fn largest(&self) -> f64 {
        // Not `amax`, which takes NaN for nothing.
        let values = self.real.iter().chain(self.imaginary.iter());
        values.fold(0.0, |largest: f64, value| if value.abs() <= largest { largest } else { value.abs() })
    }
}
