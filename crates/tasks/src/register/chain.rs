//! Poses along a chain of pairs, with covariance.

use icp_registration::IcpResult;
use nalgebra::{Isometry3, Matrix6};
use pipeline::survey::StationPose;

/// Poses of all stations from that of the first, which is the datum, and each onto the one before.
pub(crate) fn along(first: Isometry3<f64>, steps: &[IcpResult]) -> Vec<StationPose> {
    let mut poses = vec![StationPose { world_from_camera: first, covariance: Some(Matrix6::zeros()) }];
    for step in steps {
        let before = &poses[poses.len() - 1];
        let next = onto(before, step);
        poses.push(next);
    }
    poses
}

/// The pose of the source of a pair from that of its target.
fn onto(target: &StationPose, pair: &IcpResult) -> StationPose {
    let (world, relative) = (&target.world_from_camera, &pair.target_from_source);
    let turn = world.rotation.to_rotation_matrix().into_inner();
    let relative_turn = relative.rotation.to_rotation_matrix().into_inner();
    // t = t1 + R1 t2 and R = R1 R2: dt = dt1 - R1 [t2]x dtheta1 + R1 dt2, dtheta = R2^T dtheta1 + dtheta2.
    let (mut by_target, mut by_pair) = (Matrix6::identity(), Matrix6::identity());
    by_target.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-turn * relative.translation.vector.cross_matrix()));
    by_target.fixed_view_mut::<3, 3>(3, 3).copy_from(&relative_turn.transpose());
    by_pair.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn);
    let known = target.covariance.unwrap_or_else(Matrix6::zeros);
    let covariance = by_target * known * by_target.transpose() + by_pair * pair.covariance * by_pair.transpose();
    StationPose { world_from_camera: world * relative, covariance: Some((covariance + covariance.transpose()) * 0.5) }
}

#[cfg(test)]
mod tests {
    // Panics are how a test fails.
    #![allow(clippy::unwrap_used)]

    use icp_registration::StopReason;
    use nalgebra::{UnitQuaternion, Vector3, Vector6};
    use rigid_pose::{pose_difference, step_pose};

    use super::*;

    fn pair(pose: Isometry3<f64>, covariance: &Matrix6<f64>) -> IcpResult {
        IcpResult {
            target_from_source: pose,
            covariance: *covariance,
            overlap: 1.0,
            rms_m: 0.0,
            iterations: 1,
            stop: StopReason::Converged,
            correspondences: 1,
            max_correspondence_distance_m: 1.0,
            degenerate: Vec::new(),
        }
    }

    #[test]
    fn the_covariance_of_a_chain_is_that_of_small_steps() {
        let pose = |k: f64| {
            let turn = UnitQuaternion::from_euler_angles(0.3 * k, -0.2, 0.1 + 0.4 * k);
            Isometry3::from_parts(Vector3::new(1.0 + k, -0.5 * k, 0.3).into(), turn)
        };
        let covariance = |k: f64| {
            let root = Matrix6::from_fn(|r, c| ((1 + r + 2 * c) as f64 * (1.0 + k)).sin());
            1e-6 * root * root.transpose()
        };
        let pairs = [pair(pose(0.0), &covariance(0.0)), pair(pose(1.0), &covariance(1.0))];
        let first = pose(-0.7);
        let chain = along(first, &pairs);

        // Jacobians by differences: the last pose as a function of a step of either pair.
        let mut expected = Matrix6::zeros();
        for moved in 0..2 {
            let mut jacobian = Matrix6::zeros();
            for axis in 0..6 {
                let mut step = Vector6::zeros();
                step[axis] = 1e-6;
                let end = |sign: f64| {
                    let mut steps = pairs.clone();
                    steps[moved].target_from_source = step_pose(&pairs[moved].target_from_source, &(sign * step));
                    along(first, &steps)[2].world_from_camera
                };
                jacobian.set_column(axis, &(pose_difference(&end(-1.0), &end(1.0)) / 2e-6));
            }
            expected += jacobian * pairs[moved].covariance * jacobian.transpose();
        }
        let found = chain[2].covariance.unwrap();
        // Central differences of 1e-6 are good to about 1e-9 of entries of order one.
        assert!((found - expected).norm() < 1e-7 * expected.norm(), "{found} {expected}");
        assert!(chain[0].covariance.unwrap().norm() < 1e-300, "the first is the datum");
    }
}
