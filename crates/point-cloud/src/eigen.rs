//! Eigenvalues and vectors of symmetric 3x3 matrices in closed form: of the second moments of points.

use nalgebra::{Matrix3, Vector3};

/// Eigenvalues of a symmetric 3x3 matrix in ascending order (trigonometric solution of the characteristic cubic).
#[must_use]
pub fn eigenvalues3(m: &Matrix3<f64>) -> [f64; 3] {
    let off = m[(0, 1)].powi(2) + m[(0, 2)].powi(2) + m[(1, 2)].powi(2);
    let mean = m.trace() / 3.0;
    let deviation = m - Matrix3::identity() * mean;
    let p2 = deviation.diagonal().norm_squared() + 2.0 * off;
    let p = (p2 / 6.0).sqrt();
    // A multiple of the identity, or no matrix at all.
    if p.is_nan() || p <= f64::MIN_POSITIVE {
        return [mean; 3];
    }
    let half_det = ((deviation / p).determinant() / 2.0).clamp(-1.0, 1.0);
    let angle = half_det.acos() / 3.0;
    let largest = mean + 2.0 * p * angle.cos();
    let smallest = mean + 2.0 * p * (angle + 2.0 * std::f64::consts::FRAC_PI_3).cos();
    [smallest, 3.0 * mean - largest - smallest, largest]
}

/// Unit eigenvector of the simple eigenvalue `value` of a symmetric 3x3 matrix; `None` where it is not simple.
#[must_use]
pub fn eigenvector3(m: &Matrix3<f64>, value: f64) -> Option<Vector3<f64>> {
    // Rows of m - value I span the plane normal to the vector: the longest cross product is the most accurate.
    let shifted = m - Matrix3::identity() * value;
    let rows = [0, 1, 2].map(|i| shifted.row(i).transpose());
    let mut best = Vector3::zeros();
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        let cross = rows[i].cross(&rows[j]);
        if cross.norm_squared() > best.norm_squared() {
            best = cross;
        }
    }
    let scale = shifted.norm_squared();
    let length = best.norm();
    // The cross product is the product of the two other gaps; far below the scale it is rounding.
    (length > 1e-10 * scale && length > 0.0).then(|| best / length)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use nalgebra::SymmetricEigen;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn closed_form_agrees_with_the_iteration(v in prop::array::uniform6(-10.0..10.0_f64)) {
            let m = Matrix3::new(v[0], v[1], v[2], v[1], v[3], v[4], v[2], v[4], v[5]);
            let mut expected: Vec<f64> = SymmetricEigen::new(m).eigenvalues.iter().copied().collect();
            expected.sort_by(f64::total_cmp);
            let found = eigenvalues3(&m);
            for (f, e) in found.iter().zip(&expected) {
                // The cubic loses half the digits where eigenvalues nearly coincide.
                prop_assert!((f - e).abs() < 1e-6, "{found:?} {expected:?}");
            }
            if found[1] - found[0] > 0.1 {
                let n = eigenvector3(&m, found[0]).unwrap();
                prop_assert!((m * n - n * found[0]).norm() < 1e-6);
            }
        }
    }

    #[test]
    fn a_double_eigenvalue_has_no_vector() {
        assert!(eigenvector3(&Matrix3::identity(), 1.0).is_none());
        let line = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 1.0));
        assert!(eigenvector3(&line, 0.0).is_none());
        assert!(eigenvector3(&Matrix3::from_element(f64::NAN), 0.0).is_none());
    }
}
