//! Dual quaternions `[Walker1991]`: rotation and translation from one eigenvalue problem.

use nalgebra::{Matrix4, Point3, UnitQuaternion, Vector3};

use super::quaternion_of_largest;
use crate::error::Result;

/// Real part r of the dual quaternion that minimises `Σ w |q r − r p − u|²` over unit r and the dual part `u = t r`.
///
/// The best u is the mean of `(Q(q) − W(p)) r`; what is left is a quadratic form in r. `spread`: the norm of the moments
/// about the means, to which the gap between the two best rotations is related.
pub(super) fn rotation(
    source: &[Point3<f64>],
    target: &[Point3<f64>],
    weights: Option<&[f64]>,
    spread: f64,
) -> Result<UnitQuaternion<f64>> {
    let mut total = 0.0;
    let mut sum = Matrix4::zeros();
    let mut squares = Matrix4::zeros();
    for (i, (p, q)) in source.iter().zip(target).enumerate() {
        let weight = weights.map_or(1.0, |w| w[i]);
        let b = left(&q.coords) - right(&p.coords);
        total += weight;
        sum += b * weight;
        squares += b.transpose() * b * weight;
    }
    let form = squares - sum.transpose() * sum / total;
    // The sum of squares is a constant less twice Horn's form.
    quaternion_of_largest(-(form + form.transpose()) * 0.5, 2.0 * spread, "the eigenvalue problem of dual quaternions")
}

/// Matrix of the product `q r` with a pure quaternion q.
fn left(q: &Vector3<f64>) -> Matrix4<f64> {
    let mut matrix = Matrix4::zeros();
    matrix.fixed_view_mut::<3, 3>(1, 1).copy_from(&q.cross_matrix());
    border(matrix, q)
}

/// Matrix of the product `r p` with a pure quaternion p.
fn right(p: &Vector3<f64>) -> Matrix4<f64> {
    let mut matrix = Matrix4::zeros();
    matrix.fixed_view_mut::<3, 3>(1, 1).copy_from(&-p.cross_matrix());
    border(matrix, p)
}

fn border(mut matrix: Matrix4<f64>, v: &Vector3<f64>) -> Matrix4<f64> {
    for k in 0..3 {
        matrix[(0, k + 1)] = -v[k];
        matrix[(k + 1, 0)] = v[k];
    }
    matrix
}
