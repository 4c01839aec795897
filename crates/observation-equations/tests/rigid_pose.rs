//! Steps and differences of poses.

use approx::assert_relative_eq;
use nalgebra::{Isometry3, Vector3};
use observation_equations::{Manifold, RigidPose};

/// The same manifold with the trait's own differences.
#[derive(Debug)]
struct ByDifferences;

impl Manifold for ByDifferences {
    fn ambient_dimension(&self) -> usize {
        7
    }
    fn tangent_dimension(&self) -> usize {
        6
    }
    fn plus(&self, values: &[f64], step: &[f64], out: &mut [f64]) {
        RigidPose.plus(values, step, out);
    }
    fn minus(&self, values: &[f64], reference: &[f64], out: &mut [f64]) {
        RigidPose.minus(values, reference, out);
    }
}

fn pose(turn: [f64; 3]) -> [f64; 7] {
    RigidPose::values(&Isometry3::new(Vector3::new(1.0, -2.0, 0.5), Vector3::from(turn)))
}

#[test]
fn minus_undoes_plus() {
    for turn in [[0.0; 3], [1e-9, 0.0, 0.0], [0.3, -0.2, 0.1], [2.0, 1.0, -2.0]] {
        for step in [[0.1, 0.2, -0.3, 0.01, -0.02, 0.03], [5.0, 0.0, 0.0, 1.5, -2.0, 1.0]] {
            let (mut moved, mut back) = ([0.0; 7], [0.0; 6]);
            RigidPose.plus(&pose(turn), &step, &mut moved);
            RigidPose.minus(&moved, &pose(turn), &mut back);
            for (a, b) in step.iter().zip(back) {
                assert_relative_eq!(*a, b, epsilon = 1e-12);
            }
            assert_eq!(RigidPose.check(&moved), Ok(()));
        }
    }
}

#[test]
fn jacobian_of_minus_agrees_with_differences() {
    // From no rotation through the change of formula (1e-3 rad) to 3 rad.
    for angle in [0.0, 1e-6, 0.999e-3, 1.001e-3, 0.1, 1.0, 3.0] {
        let values = pose([0.6 * angle, -0.64 * angle, 0.48 * angle]);
        let (mut analytic, mut numeric) = ([0.0; 36], [0.0; 36]);
        RigidPose.minus_jacobian(&values, &pose([0.0; 3]), &mut analytic);
        ByDifferences.minus_jacobian(&values, &pose([0.0; 3]), &mut numeric);
        for (a, n) in analytic.iter().zip(numeric) {
            // Central differences with steps of 6e-6.
            assert_relative_eq!(*a, n, epsilon = 1e-8);
        }
    }
}

#[test]
fn the_step_is_in_world_axes_for_position_and_body_axes_for_rotation() {
    let start = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2));
    let mut moved = [0.0; 7];
    RigidPose.plus(&RigidPose::values(&start), &[1.0, 0.0, 0.0, 0.1, 0.0, 0.0], &mut moved);
    let Ok(moved) = RigidPose::isometry(&moved) else { unreachable!("seven values") };
    assert_relative_eq!(moved.translation.vector, Vector3::new(2.0, 2.0, 3.0), epsilon = 1e-15);
    // A turn about the body's x axis, which lies along the world's y.
    let turn = (moved.rotation * start.rotation.inverse()).scaled_axis();
    assert_relative_eq!(turn, Vector3::new(0.0, 0.1, 0.0), epsilon = 1e-15);
    assert!(RigidPose::isometry(&[0.0; 3]).is_err());
}
