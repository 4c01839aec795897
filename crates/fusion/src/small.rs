//! Symmetric matrices as six numbers: xx, xy, xz, yy, yz, zz.

use nalgebra::{Matrix3, Vector3};

/// A symmetric 3x3 matrix.
pub(crate) type Symmetric = [f64; 6];

pub(crate) fn from_matrix(m: &Matrix3<f64>) -> Symmetric {
    [m[(0, 0)], m[(0, 1)], m[(0, 2)], m[(1, 1)], m[(1, 2)], m[(2, 2)]]
}

pub(crate) fn to_matrix(s: &Symmetric) -> Matrix3<f64> {
    Matrix3::new(s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5])
}

pub(crate) fn outer(v: &Vector3<f64>) -> Symmetric {
    [v.x * v.x, v.x * v.y, v.x * v.z, v.y * v.y, v.y * v.z, v.z * v.z]
}

/// Adds `factor` times `other`.
#[inline]
pub(crate) fn add(sum: &mut Symmetric, other: &Symmetric, factor: f64) {
    for (sum, other) in sum.iter_mut().zip(other) {
        *sum += factor * other;
    }
}

/// `nᵀ S n`.
#[inline]
pub(crate) fn quadratic(s: &Symmetric, n: &Vector3<f64>) -> f64 {
    s[0] * n.x * n.x
        + s[3] * n.y * n.y
        + s[5] * n.z * n.z
        + 2.0 * (s[1] * n.x * n.y + s[2] * n.x * n.z + s[4] * n.y * n.z)
}

/// Two unit vectors that with `n` are orthogonal.
pub(crate) fn tangents(n: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let axis = Vector3::ith(n.iamin(), 1.0);
    let first = n.cross(&axis).normalize();
    [first, n.cross(&first)]
}
