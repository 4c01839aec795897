//! Singular value decomposition `[Arun1987]`, with the sign of `[Umeyama1991]` for mirrored and plane sets.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::require_gap;
use crate::error::Result;

/// Sweeps of Jacobi rotations; convergence is quadratic, five are usual.
const SWEEPS: usize = 30;

/// `R = V diag(1, 1, det(V Uᵀ)) Uᵀ` of `Σ w p' q'^T = U S Vᵀ`.
pub(super) fn rotation(cross: &Matrix3<f64>) -> Result<UnitQuaternion<f64>> {
    let (images, v) = orthogonal_columns(cross / cross.norm().max(f64::MIN_POSITIVE));
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| images.column(b).norm().total_cmp(&images.column(a).norm()));
    let value = |k: usize| images.column(order[k]).norm();
    let sign = if cross.determinant() < 0.0 { -1.0 } else { 1.0 };
    // Turned by half about the first axis the sum would change by the next two.
    require_gap(2.0 * (value(1) + sign * value(2)))?;
    let unit = |k: usize| -> Vector3<f64> { images.column(order[k]) / value(k) };
    let axis = |k: usize| -> Vector3<f64> { v.column(order[k]).into() };
    // The third axes complete right-handed frames, which is what the sign does.
    let (u, w) = ([unit(0), unit(1)], [axis(0), axis(1)]);
    let from = Matrix3::from_columns(&[u[0], u[1], u[0].cross(&u[1])]);
    let to = Matrix3::from_columns(&[w[0], w[1], w[0].cross(&w[1])]);
    Ok(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(to * from.transpose())))
}

/// `A V` with orthogonal columns, and V: one-sided Jacobi rotations, which keep small singular values to all their
/// digits, where the square of the matrix would lose half of them.
fn orthogonal_columns(mut a: Matrix3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
    let mut v = Matrix3::identity();
    for _ in 0..SWEEPS {
        let mut largest: f64 = 0.0;
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            let (p, q, r) = (a.column(i).norm_squared(), a.column(j).norm_squared(), a.column(i).dot(&a.column(j)));
            if r.abs() <= f64::EPSILON * (p * q).sqrt() {
                continue;
            }
            largest = largest.max(r.abs() / (p * q).sqrt());
            let tau = (q - p) / (2.0 * r);
            let tangent = tau.signum() / (tau.abs() + tau.hypot(1.0));
            let cosine = 1.0 / tangent.hypot(1.0);
            for matrix in [&mut a, &mut v] {
                let (x, y) = (matrix.column(i).into_owned(), matrix.column(j).into_owned());
                matrix.set_column(i, &((x - y * tangent) * cosine));
                matrix.set_column(j, &((x * tangent + y) * cosine));
            }
        }
        if largest <= 4.0 * f64::EPSILON {
            break;
        }
    }
    (a, v)
}
