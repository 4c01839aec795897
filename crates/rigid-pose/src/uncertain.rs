//! Poses with their covariance, put one behind the other.

use nalgebra::{Isometry3, Matrix6};

use crate::tangent::{inverse_covariance_transport, pose_difference, step_pose, symmetrised};

/// A pose `a_from_b` with its covariance in the tangent `[dt a axes, dtheta b axes]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uncertain {
    /// The pose.
    pub pose: Isometry3<f64>,
    /// Its covariance, metre and radian squared.
    pub covariance: Matrix6<f64>,
}

impl Uncertain {
    /// A pose without errors.
    #[must_use]
    pub fn exact(pose: Isometry3<f64>) -> Self {
        Self { pose, covariance: Matrix6::zeros() }
    }

    /// `b_from_a`.
    #[must_use]
    pub fn inverse(&self) -> Self {
        Self { pose: self.pose.inverse(), covariance: inverse_covariance_transport(&self.pose, &self.covariance) }
    }

    /// `a_from_c` from this `a_from_b` and an independent `b_from_c`.
    #[must_use]
    pub fn then(&self, b_from_c: &Self) -> Self {
        let (by_first, by_second) = product_jacobians(&self.pose, &b_from_c.pose);
        let covariance =
            by_first * self.covariance * by_first.transpose() + by_second * b_from_c.covariance * by_second.transpose();
        let mut pose = self.pose * b_from_c.pose;
        pose.rotation.renormalize();
        Self { pose, covariance: symmetrised(&covariance) }
    }

    /// The weighted mean with an independent determination of the same pose; `None` where covariances are singular.
    #[must_use]
    pub fn combined(&self, other: &Self) -> Option<Self> {
        let difference = pose_difference(&self.pose, &other.pose);
        let factor = symmetrised(&(self.covariance + other.covariance)).cholesky()?;
        let gain = factor.solve(&self.covariance).transpose();
        let kept = Matrix6::identity() - gain;
        let covariance = kept * self.covariance * kept.transpose() + gain * other.covariance * gain.transpose();
        Some(Self { pose: step_pose(&self.pose, &(gain * difference)), covariance: symmetrised(&covariance) })
    }

    /// Square of the distance to another determination in standard deviations of the two.
    #[must_use]
    pub fn mahalanobis_squared(&self, other: &Self) -> Option<f64> {
        let difference = pose_difference(&self.pose, &other.pose);
        let factor = symmetrised(&(self.covariance + other.covariance)).cholesky()?;
        Some(difference.dot(&factor.solve(&difference)))
    }

    /// Largest standard deviation of a point at `radius_m` from the origin, about, metre.
    #[must_use]
    pub fn sigma_at(&self, radius_m: f64) -> f64 {
        let block = |at: usize| self.covariance.fixed_view::<3, 3>(at, at).symmetric_eigenvalues().max().max(0.0);
        (block(0) + radius_m * radius_m * block(3)).sqrt()
    }
}

/// Jacobians of the tangent of `a_from_b · b_from_c` by those of its factors.
#[must_use]
pub fn product_jacobians(a_from_b: &Isometry3<f64>, b_from_c: &Isometry3<f64>) -> (Matrix6<f64>, Matrix6<f64>) {
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

/// Jacobians of the tangent of `a_from_b`, the one of two poses in the frame of the other, by those of `world_from_a` and
/// `world_from_b`.
#[must_use]
pub fn relative_jacobians(world_from_a: &Isometry3<f64>, a_from_b: &Isometry3<f64>) -> [Matrix6<f64>; 2] {
    let (by_inverse, by_second) = product_jacobians(&world_from_a.inverse(), &(world_from_a * a_from_b));
    [by_inverse * inverse_jacobian(world_from_a), by_second]
}

/// Jacobian of the tangent of the inverse.
#[must_use]
pub fn inverse_jacobian(a_from_b: &Isometry3<f64>) -> Matrix6<f64> {
    let r = a_from_b.rotation.to_rotation_matrix().into_inner();
    let lever = (r.transpose() * a_from_b.translation.vector).cross_matrix();
    let mut jacobian = Matrix6::zeros();
    jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&-r.transpose());
    jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&-lever);
    jacobian.fixed_view_mut::<3, 3>(3, 3).copy_from(&-r);
    jacobian
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use nalgebra::{Vector3, Vector6};

    fn pose(seed: f64) -> Isometry3<f64> {
        Isometry3::new(Vector3::new(seed, -0.4 * seed, 0.3), Vector3::new(0.5 - seed, 0.8, -0.2 * seed))
    }

    #[test]
    fn jacobians_of_products_agree_with_differences() {
        let (a, b) = (pose(1.1), pose(-0.6));
        let (by_first, by_second) = product_jacobians(&a, &b);
        let by = relative_jacobians(&a, &(a.inverse() * b));
        let step = 1e-6;
        for k in 0..6 {
            let e = Vector6::from_fn(|i, _| if i == k { step } else { 0.0 });
            let first = pose_difference(&(a * b), &(step_pose(&a, &e) * b)) / step;
            let second = pose_difference(&(a * b), &(a * step_pose(&b, &e))) / step;
            // One-sided differences of curved rotations at 1e-6.
            assert!((first - by_first.column(k)).norm() < 1e-5);
            assert!((second - by_second.column(k)).norm() < 1e-5);
            let relative = a.inverse() * b;
            let first = pose_difference(&relative, &(step_pose(&a, &e).inverse() * b)) / step;
            let second = pose_difference(&relative, &(a.inverse() * step_pose(&b, &e))) / step;
            assert!((first - by[0].column(k)).norm() < 1e-5 && (second - by[1].column(k)).norm() < 1e-5);
        }
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
