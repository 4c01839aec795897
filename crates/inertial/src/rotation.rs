//! Derivatives of rotation vectors.

use nalgebra::{Matrix3, Vector3};

/// Below this angle (radian) series of second order have all digits.
const SMALL: f64 = 1e-4;

/// Right Jacobian: `exp(θ + δ) = exp(θ) exp(J δ)`.
pub(crate) fn right_jacobian(theta: &Vector3<f64>) -> Matrix3<f64> {
    let angle = theta.norm();
    let cross = theta.cross_matrix();
    let (first, second) = if angle < SMALL {
        (0.5 - angle * angle / 24.0, 1.0 / 6.0)
    } else {
        ((1.0 - angle.cos()) / angle.powi(2), (angle - angle.sin()) / angle.powi(3))
    };
    Matrix3::identity() - cross * first + cross * cross * second
}

/// Inverse of the right Jacobian: `log(exp(θ) exp(δ)) = θ + J⁻¹ δ`.
pub(crate) fn right_jacobian_inverse(theta: &Vector3<f64>) -> Matrix3<f64> {
    let angle = theta.norm();
    let cross = theta.cross_matrix();
    let second = if angle < SMALL { 1.0 / 12.0 } else { (1.0 - 0.5 * angle / (0.5 * angle).tan()) / (angle * angle) };
    Matrix3::identity() + cross * 0.5 + cross * cross * second
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    #[test]
    fn jacobians_agree_with_differences() {
        for theta in [Vector3::zeros(), Vector3::new(2e-5, -1e-5, 3e-5), Vector3::new(0.4, -1.1, 0.7)] {
            let inverse = right_jacobian(&theta) * right_jacobian_inverse(&theta);
            assert!((inverse - Matrix3::identity()).norm() < 1e-9, "{theta}");
            for k in 0..3 {
                let e = Vector3::from_fn(|i, _| if i == k { 1e-6 } else { 0.0 });
                let exp = UnitQuaternion::from_scaled_axis;
                let slope = ((exp(theta - e)).inverse() * exp(theta + e)).scaled_axis() / 2e-6;
                assert!((slope - right_jacobian(&theta).column(k)).norm() < 1e-8, "{theta} {k}");
            }
        }
    }
}
