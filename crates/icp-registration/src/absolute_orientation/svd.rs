//! Singular value decomposition `[Arun1987]`, with the sign of `[Umeyama1991]` for mirrored and plane sets.

use nalgebra::{Matrix3, Rotation3, SVD, UnitQuaternion, Vector3};

use super::require_gap;
use crate::error::{Error, Result};

/// `R = V diag(1, 1, det(V Uᵀ)) Uᵀ` of `Σ w p' q'^T = U S Vᵀ`.
pub(super) fn rotation(cross: &Matrix3<f64>) -> Result<UnitQuaternion<f64>> {
    let scaled = cross / cross.norm().max(f64::MIN_POSITIVE);
    let failed = Error::Numerical { what: "the singular values of the moments", why: "the iteration did not converge" };
    // Sorted in falling order.
    let svd = SVD::try_new(scaled, true, true, f64::EPSILON, 1000).ok_or(failed.clone())?;
    let (Some(u), Some(v_transposed)) = (svd.u, svd.v_t) else { return Err(failed) };
    let v = v_transposed.transpose();
    let sign = if (v * u.transpose()).determinant() < 0.0 { -1.0 } else { 1.0 };
    // Turned by half about the first axis the sum would change by the next two.
    require_gap(2.0 * (svd.singular_values[1] + sign * svd.singular_values[2]))?;
    let matrix = v * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * u.transpose();
    Ok(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix)))
}
