//! Geometry that does not determine the pose is named.

use icp_registration::{DegeneracyPolicy, MotionKind, VoxelAlignmentOptions};
use nalgebra::{Isometry3, Vector3};

use super::register;
use super::scenes::{Views, corridor, cylinder, one_wall, parallel_walls, repeated, sphere, wall_and_floor};
use crate::common::Pinhole;

/// Draws the views of a scene.
type MakeViews = fn(&Pinhole, u64) -> Views;

#[test]
fn undetermined_motions_are_named() {
    let scenes: [(MakeViews, [usize; 2]); 7] = [
        (one_wall, [2, 1]),
        (wall_and_floor, [1, 0]),
        (corridor, [1, 0]),
        (parallel_walls, [2, 1]),
        (sphere, [0, 3]),
        (cylinder, [1, 1]),
        (repeated, [0, 0]),
    ];
    for (number, (views, expected)) in scenes.into_iter().enumerate() {
        // The example does 50 of each.
        for seed in 0..4 {
            let views = views(&Pinhole::medium(), seed);
            let guess = views.target_from_source;
            let motions = register(&views, &guess, &VoxelAlignmentOptions::default()).unwrap().degenerate;
            let count = |kind| motions.iter().filter(|m| m.kind == kind).count();
            let found = [count(MotionKind::Translation), count(MotionKind::Rotation)];
            assert_eq!(found, expected, "scene {number}, seed {seed}: {motions:?}");
        }
    }
}

#[test]
fn held_motions_stay_at_the_guess() {
    let views = corridor(&Pinhole::medium(), 3);
    // The corridor runs along x of the room; the target's camera looked along a diagonal of it.
    let target = crate::common::look_at([0.0, 0.2, 1.4], [1.5, -1.0, 0.6]);
    let along = target.rotation.inverse() * Vector3::x();
    let across = target.rotation.inverse() * Vector3::new(0.0, 0.03, 0.04);
    let truth = views.target_from_source;
    let guess = Isometry3::from_parts((truth.translation.vector + across + along * 0.07).into(), truth.rotation);
    let options = VoxelAlignmentOptions {
        degeneracy: DegeneracyPolicy::HoldAtGuess,
        max_start_error_m: Some(0.2),
        ..VoxelAlignmentOptions::default()
    };
    let result = register(&views, &guess, &options).unwrap();
    let error = result.target_from_source.translation.vector - truth.translation.vector;
    // The guess kept along the axis to first order; across it what the walls say.
    assert!((error.dot(&along) - 0.07).abs() < 3e-3, "{}", error.dot(&along));
    assert!((error - along * error.dot(&along)).norm() < 2e-3, "{error}");
    assert_eq!(result.degenerate.len(), 1);
}
