//! Orthonormal matrices `[Horn1988]`: the rotation is the orthonormal factor of the polar decomposition of the moments.

use nalgebra::{Matrix3, Rotation3, SymmetricEigen, UnitQuaternion, Vector3};

use super::require_gap;
use crate::error::{InputError, Result};

/// `R = M (Mᵀ M)^(-1/2)` with `M = Σ w q' p'^T`.
///
/// The square root is taken along the two larger eigenvectors of `Mᵀ M` and the third completes a right-handed frame:
/// plane sets need no special case, and a mirror image is never returned.
pub(super) fn rotation(cross: &Matrix3<f64>) -> Result<UnitQuaternion<f64>> {
    let m = cross.transpose() / cross.norm().max(f64::MIN_POSITIVE);
    let eigen = SymmetricEigen::try_new(m.transpose() * m, 1e-16, 1000).ok_or(InputError::Numerical {
        what: "the square root of the moments",
        why: "the eigenvalue iteration did not converge",
    })?;
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let root = |k: usize| eigen.eigenvalues[order[k]].max(0.0).sqrt();
    let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    require_gap(2.0 * (root(1) + sign * root(2)))?;
    let axis = |k: usize| -> Vector3<f64> { eigen.eigenvectors.column(order[k]).into() };
    let (u, v) = (axis(0), axis(1));
    let (a, b) = (m * u / root(0), m * v / root(1));
    let matrix = Matrix3::from_columns(&[a, b, a.cross(&b)]) * Matrix3::from_columns(&[u, v, u.cross(&v)]).transpose();
    // The images of two eigenvectors are orthogonal to half the digits only.
    Ok(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_eps(
        &matrix,
        1e-15,
        100,
        Rotation3::from_matrix_unchecked(matrix),
    )))
}
