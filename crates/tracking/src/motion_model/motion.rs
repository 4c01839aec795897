//! Poses and motions with their covariance.

use nalgebra::{Isometry3, Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};

use rigid_pose::{Uncertain, inverse_left_jacobian, left_jacobian};

/// What is known of the motion from the frame before to this one, for instance from an inertial unit: all of it, or the rotation
/// alone ([`Self::of_turn`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionPrior {
    /// Pose of the previous camera in the frame of the current one.
    pub current_from_previous: Isometry3<f64>,
    /// Its covariance in the tangent `[dt current axes (m), dtheta previous axes (rad)]`.
    pub covariance: Matrix6<f64>,
}

impl MotionPrior {
    /// Of a rotation alone, as a gyroscope measures it: variances of the translation are infinite. `covariance`: radian², axes of
    /// the previous camera.
    #[must_use]
    pub fn of_turn(current_from_previous: UnitQuaternion<f64>, covariance: &Matrix3<f64>) -> Self {
        let infinite = f64::INFINITY;
        let mut whole = Matrix6::from_diagonal(&Vector6::new(infinite, infinite, infinite, 0.0, 0.0, 0.0));
        whole.fixed_view_mut::<3, 3>(3, 3).copy_from(covariance);
        Self {
            current_from_previous: Isometry3::from_parts(Vector3::zeros().into(), current_from_previous),
            covariance: whole,
        }
    }

    /// The rotation `previous_from_current` with its covariance (current axes), where nothing is known of the translation.
    pub(crate) fn turn(&self) -> Option<(UnitQuaternion<f64>, Matrix3<f64>)> {
        let unknown = (0..3).all(|k| self.covariance[(k, k)] == f64::INFINITY);
        let rotation = self.current_from_previous.rotation;
        let r = rotation.to_rotation_matrix().into_inner();
        let own = self.covariance.fixed_view::<3, 3>(3, 3).into_owned();
        unknown.then(|| (rotation.inverse(), r * own * r.transpose()))
    }

    /// Whether it can be used: finite, its covariance positive definite.
    pub(crate) fn is_sound(&self) -> bool {
        if let Some((_, covariance)) = self.turn() {
            let finite = covariance.iter().all(|v| v.is_finite());
            return rigid_pose::is_finite(&self.current_from_previous) && finite && covariance.cholesky().is_some();
        }
        rigid_pose::is_finite(&self.current_from_previous)
            && self.covariance.iter().all(|v| v.is_finite())
            && self.covariance.cholesky().is_some()
    }

    pub(crate) fn previous_from_current(&self) -> Uncertain {
        Uncertain { pose: self.current_from_previous, covariance: self.covariance }.inverse()
    }
}

/// The same for each axis of the translation, and of the rotation.
pub(crate) fn diagonal([shift, turn]: [f64; 2]) -> Matrix6<f64> {
    Matrix6::from_diagonal(&Vector6::new(shift, shift, shift, turn, turn, turn))
}

/// The motion along a screw `[ρ, θ]`: it turns by θ while it goes straight on by ρ in axes that turn along.
pub(crate) fn exponential(screw: &Vector6<f64>) -> Isometry3<f64> {
    let (straight, turn) = (screw.fixed_rows::<3>(0), screw.fixed_rows::<3>(3).into_owned());
    let rotation = UnitQuaternion::from_scaled_axis(turn);
    Isometry3::from_parts((left_jacobian(&turn) * straight).into(), rotation)
}

/// The screw of a motion.
pub(crate) fn logarithm(motion: &Isometry3<f64>) -> Vector6<f64> {
    let (turn, shift) = (motion.rotation.scaled_axis(), motion.translation.vector);
    let straight = inverse_left_jacobian(&turn) * shift;
    Vector6::new(straight.x, straight.y, straight.z, turn.x, turn.y, turn.z)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use rigid_pose::pose_difference;

    fn pose(seed: f64) -> Isometry3<f64> {
        Isometry3::new(Vector3::new(seed, -0.4 * seed, 0.3), Vector3::new(0.5 - seed, 0.8, -0.2 * seed))
    }

    #[test]
    fn halves_of_a_motion_make_the_whole() {
        let share = |motion: &Isometry3<f64>, share: f64| exponential(&(logarithm(motion) * share));
        let motion = pose(0.7);
        let half = share(&motion, 0.5);
        // Rounding.
        assert!(pose_difference(&(half * half), &motion).norm() < 1e-12);
        let tiny = Isometry3::new(Vector3::new(0.1, 0.2, 0.3), Vector3::new(1e-5, 0.0, 0.0));
        let third = share(&tiny, 1.0 / 3.0);
        assert!(pose_difference(&(third * third * third), &tiny).norm() < 1e-12);
    }
}
