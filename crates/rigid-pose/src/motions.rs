//! Principal motions of a symmetric matrix of six components, by a bounded iteration.

use nalgebra::{Matrix6, SymmetricEigen, Vector6};

use crate::error::{InputError, Result};

/// Eigenvalues (ascending) and matching unit eigenvectors (columns) of a symmetric 6x6 matrix.
///
/// # Errors
/// [`InputError::Numerical`] where the matrix is not finite or the iteration does not end; `what` names it.
pub fn eigen6(m: &Matrix6<f64>, what: &'static str) -> Result<(Vector6<f64>, Matrix6<f64>)> {
    if m.iter().any(|v| !v.is_finite()) {
        return Err(InputError::Numerical { what, why: "the matrix is not finite" });
    }
    let eigen = SymmetricEigen::try_new(*m, 1e-15, 1000)
        .ok_or(InputError::Numerical { what, why: "the eigenvalue iteration did not converge" })?;
    let mut order = [0, 1, 2, 3, 4, 5];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let values = Vector6::from_fn(|i, _| eigen.eigenvalues[order[i]]);
    let vectors = Matrix6::from_fn(|r, c| eigen.eigenvectors[(r, order[c])]);
    Ok((values, vectors))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn six_by_six_refuses_what_is_not_finite() {
        assert!(eigen6(&Matrix6::from_element(f64::NAN), "test").is_err());
    }
}
