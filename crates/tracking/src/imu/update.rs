//! What the frames measured of the same motion corrects the state.

use nalgebra::{Isometry3, Matrix6, SMatrix, UnitQuaternion, Vector3};

use super::state::{ACCEL_BIAS, ATTITUDE, DISPLACEMENT, GYRO_BIAS, Matrix18, ROTATION, State, VELOCITY};
use crate::error::{Error, Result};
use rigid_pose::{pose_difference, step_pose, symmetrised};

/// Kalman update by a measured `start_from_body` with its covariance in the tangent of that pose.
pub(super) fn update(state: &mut State, start_from_body: &Isometry3<f64>, covariance: &Matrix6<f64>) -> Result<()> {
    let innovation = pose_difference(&state.start_from_body(), start_from_body);
    let predicted: Matrix6<f64> = state.covariance.fixed_view::<6, 6>(0, 0).into_owned();
    let factor = symmetrised(&(predicted + covariance))
        .cholesky()
        .filter(|_| covariance.iter().all(|v| v.is_finite()))
        .ok_or(Error::Numerical { what: "the measured motion", why: "its covariance is not positive definite" })?;
    let observed: SMatrix<f64, 18, 6> = state.covariance.fixed_columns::<6>(0).into_owned();
    let gain = factor.solve(&observed.transpose()).transpose();
    let step = gain * innovation;
    // Joseph's form keeps the covariance positive whatever the rounding.
    let mut kept = Matrix18::identity();
    let mut left = kept.fixed_columns_mut::<6>(0);
    left -= gain;
    state.covariance = kept * state.covariance * kept.transpose() + gain * covariance * gain.transpose();
    state.symmetrise();

    let part = |at: usize| Vector3::new(step[at], step[at + 1], step[at + 2]);
    let (dt, dtheta) = (part(DISPLACEMENT), part(ROTATION));
    let moved =
        step_pose(&state.start_from_body(), &nalgebra::Vector6::new(dt.x, dt.y, dt.z, dtheta.x, dtheta.y, dtheta.z));
    (state.displacement, state.rotation) = (moved.translation.vector, moved.rotation);
    state.velocity += part(VELOCITY);
    state.world_from_start *= UnitQuaternion::from_scaled_axis(part(ATTITUDE));
    state.world_from_start.renormalize();
    state.gyro_bias += part(GYRO_BIAS);
    state.accel_bias += part(ACCEL_BIAS);
    Ok(())
}
