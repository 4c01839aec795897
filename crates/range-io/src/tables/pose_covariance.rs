//! Weighted control: what the standard deviations of a table mean for a pose.

use super::Station;
use camera_model::euler_from_pose;
use nalgebra::{Matrix3, Matrix6, Rotation3, Vector3};

/// Stands for "position not known" beside a known attitude: far beyond any network, so it carries no weight.
const UNKNOWN_POSITION_SIGMA_M: f64 = 1e4;

/// Stands for "attitude not known" beside a known position: more than a whole turn.
const UNKNOWN_ATTITUDE_SIGMA_RAD: f64 = 10.0;

/// Covariance of a pose's tangent step `[dt world m, dθ camera rad]`; `None` where the table gives no standard
/// deviation.
pub fn pose_covariance(row: &Station) -> Option<Matrix6<f64>> {
    if row.sigma_position_m.is_none() && row.sigma_attitude_rad.is_none() {
        return None;
    }
    let position = row.sigma_position_m.unwrap_or([UNKNOWN_POSITION_SIGMA_M; 3]);
    let attitude = match row.sigma_attitude_rad {
        Some(sigma) => {
            let steps = steps_of_angles(row);
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
fn steps_of_angles(row: &Station) -> Matrix3<f64> {
    let [_, phi, kappa] = euler_from_pose(&row.world_from_camera);
    let back = |axis, angle: f64| Rotation3::from_axis_angle(&axis, -angle);
    let (y, z) = (back(Vector3::y_axis(), phi), back(Vector3::z_axis(), kappa));
    Matrix3::from_columns(&[z * (y * Vector3::x()), z * Vector3::y(), Vector3::z()])
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use camera_model::pose_from_euler;

    use super::*;

    #[test]
    fn steps_of_angles_agree_with_differences() {
        let angles = [1.4, -0.3, 0.7];
        let row = Station {
            station: "S".to_owned(),
            world_from_camera: pose_from_euler(Vector3::new(1.0, 2.0, 3.0), angles),
            sigma_position_m: Some([0.001, 0.002, 0.003]),
            sigma_attitude_rad: Some([0.01, 0.02, 0.03]),
            doubt: None,
        };
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
        let covariance = pose_covariance(&row).unwrap();
        let attitude = covariance.fixed_view::<3, 3>(3, 3).into_owned();
        // Differences are good to nine digits.
        assert!((attitude - expected).amax() < 1e-8 * expected.amax(), "{attitude} {expected}");
        assert!((covariance[(2, 2)] - 9e-6).abs() < 1e-18);
        assert!(pose_covariance(&Station { sigma_position_m: None, sigma_attitude_rad: None, ..row }).is_none());
    }
}
