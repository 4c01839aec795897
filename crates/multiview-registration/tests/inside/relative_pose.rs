//! Derivatives of relative poses.

use super::*;
use nalgebra::Vector3;
use rigid_pose::step_pose;

#[test]
fn the_jacobian_of_a_relative_pose_agrees_with_differences() {
    let poses = [
        Isometry3::new(Vector3::new(0.4, -1.0, 0.3), Vector3::new(0.5, -1.1, 2.0)),
        Isometry3::new(Vector3::new(-0.7, 0.2, 1.5), Vector3::new(-0.2, 0.9, 0.4)),
    ];
    // Far from the model, so that the curvature of rotations counts.
    let off = Isometry3::new(Vector3::new(0.1, 0.2, -0.3), Vector3::new(0.4, -0.3, 0.5));
    let observed = poses[0].inverse() * poses[1] * off;
    let (_, by) = relative_pose_parts(&observed, &poses[0], &poses[1]);
    for station in 0..2 {
        for axis in 0..6 {
            let residual = |step: f64| {
                let mut moved = poses;
                moved[station] =
                    step_pose(&poses[station], &Vector6::from_fn(|k, _| if k == axis { step } else { 0.0 }));
                relative_pose_parts(&observed, &moved[0], &moved[1]).0
            };
            // The residual is observed minus model. Without the inverse left Jacobian the two would differ by 0.3.
            let difference = (residual(-1e-6) - residual(1e-6)) / 2e-6;
            assert!((difference - by[station].column(axis)).norm() < 1e-8, "{station} {axis}");
        }
    }
}
