//! Poses and motions with their covariance.

use nalgebra::{Isometry3, Matrix3, Matrix6, Vector3, Vector6};

use crate::pose::{inverse_covariance_transport, pose_difference, step_pose, symmetrised};

/// What is known of the motion from the frame before to this one, for instance from an inertial unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionPrior {
    /// Pose of the previous camera in the frame of the current one.
    pub current_from_previous: Isometry3<f64>,
    /// Its covariance in the tangent `[dt current axes (m), dtheta previous axes (rad)]`.
    pub covariance: Matrix6<f64>,
}

impl MotionPrior {
    /// Whether it can be used: finite, its covariance positive definite.
    pub(super) fn is_sound(&self) -> bool {
        crate::pose::is_finite(&self.current_from_previous)
            && self.covariance.iter().all(|v| v.is_finite())
            && self.covariance.cholesky().is_some()
    }

    pub(super) fn previous_from_current(&self) -> Uncertain {
        Uncertain { pose: self.current_from_previous, covariance: self.covariance }.inverse()
    }
}

/// A pose `a_from_b` with its covariance in the tangent `[dt a axes, dtheta b axes]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Uncertain {
    pub(super) pose: Isometry3<f64>,
    pub(super) covariance: Matrix6<f64>,
}

impl Uncertain {
    pub(super) fn exact(pose: Isometry3<f64>) -> Self {
        Self { pose, covariance: Matrix6::zeros() }
    }

    pub(super) fn inverse(&self) -> Self {
        Self { pose: self.pose.inverse(), covariance: inverse_covariance_transport(&self.pose, &self.covariance) }
    }

    /// `a_from_c` from this `a_from_b` and an independent `b_from_c`.
    pub(super) fn then(&self, b_from_c: &Self) -> Self {
        let (by_first, by_second) = product_jacobians(&self.pose, &b_from_c.pose);
        let covariance =
            by_first * self.covariance * by_first.transpose() + by_second * b_from_c.covariance * by_second.transpose();
        let mut pose = self.pose * b_from_c.pose;
        pose.rotation.renormalize();
        Self { pose, covariance: symmetrised(&covariance) }
    }

    /// The weighted mean with an independent determination of the same pose; `None` where covariances are singular.
    pub(super) fn combined(&self, other: &Self) -> Option<Self> {
        let difference = pose_difference(&self.pose, &other.pose);
        let factor = symmetrised(&(self.covariance + other.covariance)).cholesky()?;
        let gain = factor.solve(&self.covariance).transpose();
        let kept = Matrix6::identity() - gain;
        let covariance = kept * self.covariance * kept.transpose() + gain * other.covariance * gain.transpose();
        Some(Self { pose: step_pose(&self.pose, &(gain * difference)), covariance: symmetrised(&covariance) })
    }

    /// Square of the distance to another determination in standard deviations of the two.
    pub(super) fn mahalanobis_squared(&self, other: &Self) -> Option<f64> {
        let difference = pose_difference(&self.pose, &other.pose);
        let factor = symmetrised(&(self.covariance + other.covariance)).cholesky()?;
        Some(difference.dot(&factor.solve(&difference)))
    }

    /// Largest standard deviation of a point at `radius_m` from the origin, about, metre.
    pub(super) fn sigma_at(&self, radius_m: f64) -> f64 {
        let block = |at: usize| self.covariance.fixed_view::<3, 3>(at, at).symmetric_eigenvalues().max().max(0.0);
        (block(0) + radius_m * radius_m * block(3)).sqrt()
    }
}

/// The same for each axis of the translation, and of the rotation.
pub(super) fn diagonal([shift, turn]: [f64; 2]) -> Matrix6<f64> {
    Matrix6::from_diagonal(&Vector6::new(shift, shift, shift, turn, turn, turn))
}

/// Jacobians of the tangent of `a_from_b · b_from_c` by those of its factors.
pub(super) fn product_jacobians(a_from_b: &Isometry3<f64>, b_from_c: &Isometry3<f64>) -> (Matrix6<f64>, Matrix6<f64>) {
    // t = ta + Ra tb: dt = dta − Ra [tb]x dθa + Ra dtb; R = Ra Rb: dθ = Rbᵀ dθa + dθb.
    let ra = a_from_b.rotation.to_rotation_matrix().into_inner();
    let rb = b_from_c.rotation.to_rotation_matrix().into_inner();
    let mut by_first = Matrix6::identity();
    by_first.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-ra * b_from_c.translation.vector.cross_matrix()));
    by_first.fixed_view_mut::<3, 3>(3, 3).copy_from(&rb.transpose());
    let mut by_second = Matrix6::identity();
    by_second.fixed_view_mut::<3, 3>(0, 0).copy_from(&ra);
    (by_first, by_second)
}

/// Jacobian of the tangent of the inverse.
pub(super) fn inverse_jacobian(a_from_b: &Isometry3<f64>) -> Matrix6<f64> {
    let r = a_from_b.rotation.to_rotation_matrix().into_inner();
    let lever = (r.transpose() * a_from_b.translation.vector).cross_matrix();
    let mut jacobian = Matrix6::zeros();
    jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&-r.transpose());
    jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&-lever);
    jacobian.fixed_view_mut::<3, 3>(3, 3).copy_from(&-r);
    jacobian
}

/// The motion along a screw `[ρ, θ]`: it turns by θ while it goes straight on by ρ in axes that turn along.
pub(super) fn exponential(screw: &Vector6<f64>) -> Isometry3<f64> {
    let (straight, turn) = (screw.fixed_rows::<3>(0), screw.fixed_rows::<3>(3).into_owned());
    let rotation = nalgebra::UnitQuaternion::from_scaled_axis(turn);
    Isometry3::from_parts((left_jacobian(&turn) * straight).into(), rotation)
}

/// The screw of a motion.
pub(super) fn logarithm(motion: &Isometry3<f64>) -> Vector6<f64> {
    let (turn, shift) = (motion.rotation.scaled_axis(), motion.translation.vector);
    let straight = left_jacobian(&turn).try_inverse().map_or(shift, |v| v * shift);
    Vector6::new(straight.x, straight.y, straight.z, turn.x, turn.y, turn.z)
}

/// `V(θ)`: the translation that a unit of straight motion becomes under a turn by θ.
fn left_jacobian(turn: &Vector3<f64>) -> Matrix3<f64> {
    let angle = turn.norm();
    let cross = turn.cross_matrix();
    // Below a thousandth of a radian the next terms are under 1e-8.
    let (first, second) = if angle < 1e-3 {
        (0.5, 1.0 / 6.0)
    } else {
        ((1.0 - angle.cos()) / angle.powi(2), (angle - angle.sin()) / angle.powi(3))
    };
    Matrix3::identity() + cross * first + cross * cross * second
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    fn pose(seed: f64) -> Isometry3<f64> {
        Isometry3::new(Vector3::new(seed, -0.4 * seed, 0.3), Vector3::new(0.5 - seed, 0.8, -0.2 * seed))
    }

    #[test]
    fn jacobians_of_products_agree_with_differences() {
        let (a, b) = (pose(1.1), pose(-0.6));
        let (by_first, by_second) = product_jacobians(&a, &b);
        let step = 1e-6;
        for k in 0..6 {
            let e = Vector6::from_fn(|i, _| if i == k { step } else { 0.0 });
            let first = pose_difference(&(a * b), &(step_pose(&a, &e) * b)) / step;
            let second = pose_difference(&(a * b), &(a * step_pose(&b, &e))) / step;
            // One-sided differences of curved rotations at 1e-6.
            assert!((first - by_first.column(k)).norm() < 1e-5);
            assert!((second - by_second.column(k)).norm() < 1e-5);
        }
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

    #[test]
    fn a_combination_is_nearer_to_the_better_one() {
        let first = Uncertain { pose: pose(0.2), covariance: Matrix6::identity() * 1e-6 };
        let moved = step_pose(&first.pose, &Vector6::repeat(3e-3));
        let second = Uncertain { pose: moved, covariance: Matrix6::identity() * 2e-6 };
        let mean = first.combined(&second).unwrap();
        // Weights 2 : 1.
        assert!((pose_difference(&first.pose, &mean.pose) - Vector6::repeat(1e-3)).norm() < 1e-8);
        assert!((mean.covariance - Matrix6::identity() * (2.0 / 3.0 * 1e-6)).norm() < 1e-15);
        assert!((first.mahalanobis_squared(&second).unwrap() - 6.0 * 9.0 / 3.0).abs() < 1e-6);
        assert!(Uncertain::exact(first.pose).combined(&Uncertain::exact(moved)).is_none());
    }
}
