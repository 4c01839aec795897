//! Derivatives of rotation vectors.

use nalgebra::{Matrix3, Vector3};

/// `J` with `exp(θ + δ) = exp(J δ) exp(θ)` to first order in δ: the left Jacobian of a turn. The right one, `exp(θ + δ) = exp(θ) exp(Jᵀ δ)`, is its
/// transpose.
#[must_use]
pub fn left_jacobian(turn: &Vector3<f64>) -> Matrix3<f64> {
    let angle = turn.norm();
    let cross = turn.cross_matrix();
    // Series end after their second term below a thousandth of a radian: the next one leaves nothing that double precision sees.
    let (first, second) = if angle < 1e-3 {
        (0.5 - angle * angle / 24.0, 1.0 / 6.0 - angle * angle / 120.0)
    } else {
        ((1.0 - angle.cos()) / angle.powi(2), (angle - angle.sin()) / angle.powi(3))
    };
    Matrix3::identity() + cross * first + cross * cross * second
}

/// `J⁻¹` with `log(exp(δ) exp(θ)) = θ + J⁻¹ δ` to first order in δ. With `log(exp(θ) exp(δ))` it is the transpose.
#[must_use]
pub fn inverse_left_jacobian(turn: &Vector3<f64>) -> Matrix3<f64> {
    let angle = turn.norm();
    let cross = turn.cross_matrix();
    let second = if angle < 1e-3 {
        1.0 / 12.0 + angle * angle / 720.0
    } else {
        (1.0 - 0.5 * angle / (0.5 * angle).tan()) / (angle * angle)
    };
    Matrix3::identity() - cross * 0.5 + cross * cross * second
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    #[test]
    fn jacobians_agree_with_differences() {
        let exp = UnitQuaternion::from_scaled_axis;
        for turn in [Vector3::zeros(), Vector3::new(2e-4, -1e-4, 3e-4), Vector3::new(0.4, -1.1, 0.7)] {
            let product = left_jacobian(&turn) * inverse_left_jacobian(&turn);
            assert!((product - Matrix3::identity()).norm() < 1e-14, "{turn}");
            for k in 0..3 {
                let e = Vector3::from_fn(|i, _| if i == k { 1e-6 } else { 0.0 });
                let left = (exp(turn + e) * exp(turn - e).inverse()).scaled_axis() / 2e-6;
                assert!((left - left_jacobian(&turn).column(k)).norm() < 1e-8, "{turn} {k}");
                let right = (exp(turn - e).inverse() * exp(turn + e)).scaled_axis() / 2e-6;
                assert!((right - left_jacobian(&turn).transpose().column(k)).norm() < 1e-8, "{turn} {k}");
            }
        }
    }
}
