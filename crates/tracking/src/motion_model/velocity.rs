//! Constant velocity, disturbed by random accelerations: where the camera is expected and how far that can be relied
//! on.
//!
//! Pose and velocity are one state with one covariance, and each registration corrects both by its own covariance (a
//! Kalman filter with white noise of acceleration, `[BarShalom2001]`, Sect. 6.2). What a frame hardly determines thus
//! hardly moves the velocity along it, which carries the pose on.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use crate::motion_model::motion::{diagonal, exponential, logarithm};
use rigid_pose::{Uncertain, product_jacobians};
use rigid_pose::{pose_difference, symmetrised};

/// Velocity of a camera at a pose.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Velocity {
    /// Per second, camera axes: `[v (m/s), w (rad/s)]`.
    twist: Vector6<f64>,
    covariance: Matrix6<f64>,
    /// Covariance of the pose (rows) with the velocity (columns).
    with_pose: Matrix6<f64>,
}

impl Velocity {
    /// From two poses in the same frame, `seconds` apart, of independent errors.
    pub(crate) fn between(before: &Uncertain, now: &Uncertain, seconds: f64, disturbance: [f64; 2]) -> Self {
        let motion = before.inverse().then(now);
        let (_, by_now) = product_jacobians(&before.pose.inverse(), &now.pose);
        Self {
            twist: logarithm(&motion.pose) / seconds,
            // The velocity between two poses is not yet that at the later one.
            covariance: motion.covariance / (seconds * seconds) + diagonal(disturbance) * (seconds / 3.0),
            with_pose: now.covariance * by_now.transpose() / seconds,
        }
    }

    /// Pose and velocity `seconds` later. `disturbance`: spectral density of the acceleration, m²/s³ and rad²/s³ per
    /// axis.
    pub(crate) fn predict(&self, pose: &Uncertain, seconds: f64, disturbance: [f64; 2]) -> (Uncertain, Self) {
        let motion = exponential(&(self.twist * seconds));
        let (by_pose, by_motion) = product_jacobians(&pose.pose, &motion);
        let noise = diagonal(disturbance);
        let cross = by_pose * self.with_pose * by_motion.transpose() * seconds;
        let moved = self.covariance * seconds.powi(2) + noise * (seconds.powi(3) / 3.0);
        let covariance = by_pose * pose.covariance * by_pose.transpose()
            + cross
            + cross.transpose()
            + by_motion * moved * by_motion.transpose();
        let velocity = Self {
            twist: self.twist,
            covariance: self.covariance + noise * seconds,
            with_pose: by_pose * self.with_pose
                + by_motion * (self.covariance * seconds + noise * (seconds.powi(2) / 2.0)),
        };
        let mut moved = pose.pose * motion;
        moved.rotation.renormalize();
        (Uncertain { pose: moved, covariance: symmetrised(&covariance) }, velocity)
    }

    /// The same where the rate of rotation is measured (camera axes, rad/s): what was known of it does not count beside that.
    pub(crate) fn turning(&self, rate: &Vector3<f64>, covariance: &Matrix3<f64>) -> Self {
        let mut out = *self;
        out.twist.fixed_rows_mut::<3>(3).copy_from(rate);
        out.covariance.fixed_columns_mut::<3>(3).fill(0.0);
        out.covariance.fixed_rows_mut::<3>(3).fill(0.0);
        out.covariance.fixed_view_mut::<3, 3>(3, 3).copy_from(covariance);
        out.with_pose.fixed_columns_mut::<3>(3).fill(0.0);
        out
    }

    /// Pose and velocity (this one belongs to `pose`) with a measurement of the pose; `None` where covariances are
    /// singular.
    pub(crate) fn correct(&self, pose: &Uncertain, measured: &Uncertain) -> Option<(Uncertain, Self)> {
        let difference = pose_difference(&pose.pose, &measured.pose);
        let factor = symmetrised(&(pose.covariance + measured.covariance)).cholesky()?;
        let pose_gain = factor.solve(&pose.covariance).transpose();
        let gain = factor.solve(&self.with_pose).transpose();
        let velocity = Self {
            twist: self.twist + gain * difference,
            covariance: symmetrised(&(self.covariance - gain * self.with_pose)),
            with_pose: (Matrix6::identity() - pose_gain) * self.with_pose,
        };
        Some((pose.combined(measured)?, velocity))
    }

    /// In the frame `a` of another keyframe, from which the present one is seen as `a_from_b`.
    pub(crate) fn seen_from(&self, a_from_b: &Uncertain, pose: &Uncertain) -> Self {
        let (_, by_pose) = product_jacobians(&a_from_b.pose, &pose.pose);
        Self { with_pose: by_pose * self.with_pose, ..*self }
    }

    /// The same with all covariances multiplied by `factor`.
    pub(crate) fn loosened(&self, factor: f64) -> Self {
        Self { covariance: self.covariance * factor, with_pose: self.with_pose * factor, ..*self }
    }

    /// The same after the pose has become the frame that poses are given in.
    pub(crate) fn at_origin(&self) -> Self {
        Self { with_pose: Matrix6::zeros(), ..*self }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use nalgebra::Isometry3;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use rigid_pose::step_pose;

    const SECONDS: f64 = 0.1;
    const SIGMA: f64 = 2e-3;
    const DISTURBANCE: f64 = 0.02;

    /// Mean normalised squared errors of the predicted and of the corrected pose after 20 frames.
    fn errors(seed: u64) -> [f64; 2] {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut draw = || Vector6::from_fn(|_, _| StandardNormal.sample(&mut random));
        let noise = Matrix6::identity() * SIGMA * SIGMA;
        let mut truth = Isometry3::new(Vector3::new(0.3, -0.2, 1.0), Vector3::new(0.4, 0.1, -0.3));
        let mut twist = Vector6::new(0.3, 0.1, -0.2, 0.2, -0.3, 0.1);
        let mut before: Option<Uncertain> = None;
        let mut state: Option<(Uncertain, Velocity)> = None;
        let mut found = [0.0; 2];
        for _ in 0..20 {
            // Ten steps within the interval, so that the acceleration is white against it.
            for _ in 0..10 {
                let kick: Vector6<f64> = draw();
                twist += kick * (DISTURBANCE * SECONDS / 10.0).sqrt();
                truth *= exponential(&(twist * (SECONDS / 10.0)));
            }
            let error: Vector6<f64> = draw();
            let measured = Uncertain { pose: step_pose(&truth, &(error * SIGMA)), covariance: noise };
            let normalised = |pose: &Uncertain| {
                let gap = pose_difference(&pose.pose, &truth);
                gap.dot(&pose.covariance.cholesky().unwrap().solve(&gap))
            };
            state = match (state, before) {
                (Some((pose, velocity)), _) => {
                    let (pose, velocity) = velocity.predict(&pose, SECONDS, [DISTURBANCE; 2]);
                    found[0] = normalised(&pose);
                    let corrected = velocity.correct(&pose, &measured).unwrap();
                    found[1] = normalised(&corrected.0);
                    Some(corrected)
                }
                (None, Some(before)) => {
                    Some((measured, Velocity::between(&before, &measured, SECONDS, [DISTURBANCE; 2])))
                }
                (None, None) => None,
            };
            before = Some(measured);
        }
        found
    }

    #[test]
    fn predictions_and_corrections_are_as_good_as_they_say() {
        let runs = 200;
        let sums = (0..runs).map(errors).fold([0.0; 2], |sum, e| [sum[0] + e[0], sum[1] + e[1]]);
        // Mean of 200 chi-squared values of 6: 6 ± 0.25; four of these, for what turns within an interval.
        for sum in sums {
            let mean = sum / runs as f64;
            assert!((5.0..7.0).contains(&mean), "{mean}");
        }
    }
}
