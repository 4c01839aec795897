//! Common errors from what was known of them before and what places add.
//!
//! With the correlations `R = V λ Vᵀ` of the prior covariance and its deviations D, `c = D V √λ z`: z has unit variance, and its
//! normal matrix `I + Lᵀ N L`, `L = D V √λ`, is positive whatever is not known or not variable at all.

use nalgebra::{DMatrix, DVector};

use super::equations::Equations;
use crate::{Error, Result};

/// Values of the common errors and their covariance.
#[derive(Debug, Clone)]
pub(crate) struct Posterior {
    pub values: DVector<f64>,
    pub covariance: DMatrix<f64>,
}

/// The right side of the equations is that of points that nothing has been taken off.
pub(crate) fn posterior(prior: &DMatrix<f64>, equations: &Equations) -> Result<Posterior> {
    let size = prior.nrows();
    let root = root(prior)?;
    let mut normal = root.transpose() * &equations.normal * &root;
    for at in 0..size {
        normal[(at, at)] += 1.0;
    }
    if !dense_matrices::cholesky(normal.as_mut_slice(), size) {
        return Err(Error::Decomposition);
    }
    let inverse = DMatrix::from_vec(size, size, dense_matrices::inverse_of_cholesky(normal.as_slice(), size));
    let covariance = &root * inverse * root.transpose();
    let covariance = (&covariance + covariance.transpose()) * 0.5;
    Ok(Posterior { values: &covariance * &equations.right, covariance })
}

/// `L` with `L Lᵀ` the covariance.
pub(super) fn root(covariance: &DMatrix<f64>) -> Result<DMatrix<f64>> {
    let size = covariance.nrows();
    let deviations: Vec<f64> = (0..size).map(|at| covariance[(at, at)].sqrt()).collect();
    let correlation = DMatrix::from_fn(size, size, |row, column| {
        let scale = deviations[row] * deviations[column];
        if scale > 0.0 { covariance[(row, column)] / scale } else { 0.0 }
    });
    let (values, vectors) =
        dense_matrices::symmetric_eigen(correlation.as_slice(), size).map_err(|_| Error::Decomposition)?;
    Ok(DMatrix::from_fn(size, size, |row, column| {
        deviations[row] * vectors[column * size + row] * values[column].max(0.0).sqrt()
    }))
}
