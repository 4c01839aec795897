//! Turns that were measured.

#![allow(clippy::unwrap_used)]

use nalgebra::{Vector3, Vector6};
use rigid_pose::step_pose;

use crate::relative_pose::relative_pose_parts;

use super::*;

#[test]
fn derivatives_of_a_turn_agree_with_differences() {
    let poses = [
        Isometry3::new(Vector3::new(0.4, -1.0, 0.3), Vector3::new(0.5, -1.1, 2.0)),
        Isometry3::new(Vector3::new(-0.7, 0.2, 1.5), Vector3::new(-0.2, 0.9, 0.4)),
    ];
    let off = UnitQuaternion::from_scaled_axis(Vector3::new(0.05, -0.02, 0.03));
    let turn = MeasuredTurn {
        first: 0,
        second: 1,
        first_from_second: poses[0].rotation.inverse() * poses[1].rotation * off,
        covariance: Matrix3::new(4.0, 1.0, 0.0, 1.0, 3.0, 0.5, 0.0, 0.5, 2.0) * 1e-4,
    };
    let linearised = |poses: &[Isometry3<f64>; 2]| {
        let RelativePose { first_from_second, rows, .. } = turn.observed(poses).unwrap();
        let (v, by) = relative_pose_parts(&first_from_second, &poses[0], &poses[1]);
        (-&rows * v, by.map(|by| &rows * by))
    };
    let (_, by) = linearised(&poses);
    for station in 0..2 {
        for axis in 0..6 {
            let moved = |step: f64| {
                let mut moved = poses;
                moved[station] =
                    step_pose(&poses[station], &Vector6::from_fn(|k, _| if k == axis { step } else { 0.0 }));
                linearised(&moved).0
            };
            let difference = (moved(1e-6) - moved(-1e-6)) / 2e-6;
            assert!((difference - by[station].column(axis)).norm() < 1e-5, "{station} {axis}");
        }
    }
}

#[test]
fn turns_are_put_together() {
    let turn = |first: usize, angle: f64| MeasuredTurn {
        first,
        second: first + 1,
        first_from_second: UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, angle)),
        covariance: Matrix3::identity() * 1e-6,
    };
    let turns = [turn(0, 0.3), turn(1, 0.4)];
    let about = |angle: f64| UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, angle));
    assert!(allows(&turns, [0, 2], &about(0.7)) && !allows(&turns, [0, 2], &about(0.3)));
    // Nothing is known of the fourth station.
    assert!(allows(&turns, [0, 3], &about(2.0)));
}
