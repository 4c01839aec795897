//! Derivatives of relative poses.

#![allow(clippy::unwrap_used)]

use super::*;
use adjust::{Adjustment, FunctionObservation, ParameterBlock, check_jacobian};

#[test]
fn the_jacobian_of_a_relative_pose_agrees_with_differences() {
    let target = Isometry3::new(Vector3::new(0.4, -1.0, 0.3), Vector3::new(0.5, -1.1, 2.0));
    let source = Isometry3::new(Vector3::new(-0.7, 0.2, 1.5), Vector3::new(-0.2, 0.9, 0.4));
    // Far from the model, so that the curvature of rotations counts.
    let observed =
        target.inverse() * source * Isometry3::new(Vector3::new(0.1, 0.2, -0.3), Vector3::new(0.4, -0.3, 0.5));
    let mut network = Adjustment::new();
    let blocks = [target, source].map(|pose| network.add_block(ParameterBlock::pose(&pose)));
    let observation = FunctionObservation::new(blocks, 6, move |poses, residual, jacobians| {
        let (v, by_target, by_source) = relative_pose_parts(&observed, poses)?;
        residual.copy_from_slice(v.as_slice());
        if let Some(jacobians) = jacobians {
            jacobians.set(0, &by_target);
            jacobians.set(1, &by_source);
        }
        Ok(())
    });
    let worst = check_jacobian(&observation, &[ParameterBlock::pose(&target), ParameterBlock::pose(&source)]);
    // Rotations far from the model are curved: differences are good to a few 1e-6 there. Without the inverse left
    // Jacobian the two would differ by 0.3.
    let worst = worst.unwrap().worst;
    assert!(worst < 1e-5, "{worst}");
}
