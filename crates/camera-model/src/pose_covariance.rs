//! Weighted control: what standard deviations of a place and of angles mean for a pose.

use nalgebra::{Isometry3, Matrix3, Matrix6, Rotation3, Vector3};

use crate::euler_from_pose;

/// Stands for "position not known" beside a known attitude: far beyond any network, so it carries no weight.
const UNKNOWN_POSITION_SIGMA_M: f64 = 1e4;

/// Stands for "attitude not known" beside a known position: more than a whole turn.
const UNKNOWN_ATTITUDE_SIGMA_RAD: f64 = 10.0;

/// Covariance of a pose's tangent step `[dt world m, dθ camera rad]` (see [`crate::step_pose`]) from the standard deviations of
/// x, y, z (metre) and of omega, phi, kappa (radian, Eq. 2); where one of them is not given, that part carries no weight. `None`
/// where neither is.
pub fn pose_covariance(
    world_from_camera: &Isometry3<f64>,
    sigma_position_m: Option<[f64; 3]>,
    sigma_attitude_rad: Option<[f64; 3]>,
) -> Option<Matrix6<f64>> {
    if sigma_position_m.is_none() && sigma_attitude_rad.is_none() {
        return None;
    }
    let position = sigma_position_m.unwrap_or([UNKNOWN_POSITION_SIGMA_M; 3]);
    let attitude = match sigma_attitude_rad {
        Some(sigma) => {
            let steps = steps_of_angles(world_from_camera);
            steps * variances(sigma) * steps.transpose()
        }
        None => variances([UNKNOWN_ATTITUDE_SIGMA_RAD; 3]),
    };
    let mut covariance = Matrix6::zeros();
    covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&variances(position));
    covariance.fixed_view_mut::<3, 3>(3, 3).copy_from(&attitude);
    Some(covariance)
}

fn variances(sigma: [f64; 3]) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::from(sigma.map(|s| s * s)))
}

/// Derivative of the tangent step dθ (camera axes) by omega, phi, kappa.
///
/// World from camera is `X(ω) Y(φ) Z(κ)` of active rotations, the transpose of Eq. 2. With `A = X Y Z`,
/// `Aᵀ dA = [Zᵀ Yᵀ e_x dω + Zᵀ e_y dφ + e_z dκ]×`.
fn steps_of_angles(world_from_camera: &Isometry3<f64>) -> Matrix3<f64> {
    let [_, phi, kappa] = euler_from_pose(world_from_camera);
    let back = |axis, angle: f64| Rotation3::from_axis_angle(&axis, -angle);
    let (y, z) = (back(Vector3::y_axis(), phi), back(Vector3::z_axis(), kappa));
    Matrix3::from_columns(&[z * (y * Vector3::x()), z * Vector3::y(), Vector3::z()])
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::pose_from_euler;

    #[test]
    fn steps_of_angles_agree_with_differences() {
        let angles = [1.4, -0.3, 0.7];
        let pose = pose_from_euler(Vector3::new(1.0, 2.0, 3.0), angles);
        let position = Some([0.001, 0.002, 0.003]);
        let mut expected = Matrix3::zeros();
        for (axis, sigma) in [0.01, 0.02, 0.03].into_iter().enumerate() {
            let moved = |step: f64| {
                let mut moved = angles;
                moved[axis] += step;
                pose_from_euler(Vector3::zeros(), moved).rotation
            };
            let step = (moved(-1e-6).inverse() * moved(1e-6)).scaled_axis() / 2e-6;
            expected += step * step.transpose() * sigma * sigma;
        }
        let covariance = pose_covariance(&pose, position, Some([0.01, 0.02, 0.03])).unwrap();
        let attitude = covariance.fixed_view::<3, 3>(3, 3).into_owned();
        // Differences are good to nine digits.
        assert!((attitude - expected).amax() < 1e-8 * expected.amax(), "{attitude} {expected}");
        assert!((covariance[(2, 2)] - 9e-6).abs() < 1e-18);
        assert!(pose_covariance(&pose, None, None).is_none());
    }
}
