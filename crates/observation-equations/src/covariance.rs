use nalgebra::{DMatrix, Dim, Matrix, RawStorage};

use crate::{Error, Result};

/// Covariance matrix of one observation (or of one prior), a priori.
#[derive(Debug, Clone, PartialEq)]
pub struct Covariance {
    matrix: DMatrix<f64>,
}

impl Covariance {
    /// One component with standard deviation `sigma`.
    pub fn from_sigma(sigma: f64) -> Self {
        Self::from_sigmas(&[sigma])
    }

    /// Uncorrelated components with the given standard deviations.
    pub fn from_sigmas(sigmas: &[f64]) -> Self {
        // A negative sigma must not pass as a positive variance; its sign is kept and refused with the matrix.
        let variance = |row: usize| sigmas[row] * sigmas[row].abs();
        let n = sigmas.len();
        Self { matrix: DMatrix::from_fn(n, n, |row, column| if row == column { variance(row) } else { 0.0 }) }
    }

    /// A full matrix.
    pub fn from_matrix<R: Dim, C: Dim, S: RawStorage<f64, R, C>>(matrix: &Matrix<f64, R, C, S>) -> Self {
        let (rows, columns) = matrix.shape();
        Self { matrix: DMatrix::from_fn(rows, columns, |row, column| matrix[(row, column)]) }
    }

    /// Appends the whitening matrix `W = L⁻¹` of `C = L Lᵀ`, lower triangle row by row, to `out`. The group is named in errors.
    ///
    /// # Errors
    /// [`Error::Length`] for another dimension; [`Error::Covariance`] for what is not symmetric and positive definite.
    pub fn whitening(&self, group: &str, dimension: usize, out: &mut Vec<f64>) -> Result<()> {
        let (rows, columns) = self.matrix.shape();
        if rows != dimension || columns != dimension {
            let what = format!("covariance of an observation of dimension {dimension} in group `{group}`");
            return Err(Error::Length { what, expected: dimension * dimension, found: rows * columns });
        }
        let refuse =
            || Error::Covariance { group: group.to_owned(), matrix: self.matrix.transpose().as_slice().to_vec() };
        let largest = self.matrix.amax();
        let symmetric = (&self.matrix - self.matrix.transpose()).amax() <= 1e-9 * largest;
        if !symmetric || self.matrix.iter().any(|value| !value.is_finite()) {
            return Err(refuse());
        }
        let factor = self.matrix.clone().cholesky().ok_or_else(refuse)?.unpack();
        // An infinite weight (an underflowed variance) is no observation but a constraint.
        let identity = DMatrix::identity(dimension, dimension);
        let inverse = factor.solve_lower_triangular(&identity).ok_or_else(refuse)?;
        if inverse.iter().any(|value| !value.is_finite()) {
            return Err(refuse());
        }
        for row in 0..dimension {
            out.extend((0..=row).map(|column| inverse[(row, column)]));
        }
        Ok(())
    }
}
