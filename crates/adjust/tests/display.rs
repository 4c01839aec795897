//! A solution printed.

use adjust::{Adjustment, Covariance, LinearObservation, ParameterBlock, RigidPose, SolveOptions};
use nalgebra::{Isometry3, Vector3};

#[test]
fn a_solution_is_a_table_with_a_verdict() {
    let mut a = Adjustment::new();
    let line = a.add_block(ParameterBlock::euclidean([0.0, 0.0]).with_parameter_names(["offset", "slope"]));
    let scale = a.add_block(ParameterBlock::euclidean([1.5]).named("scale"));
    let pose = Isometry3::new(Vector3::new(1.0, 2.0, -3.0), Vector3::new(0.1, 0.0, 0.2));
    let camera = a.add_block(ParameterBlock::pose(&pose).named("camera"));
    a.hold(scale).unwrap();
    let sigmas = [1e-4, 1e-4, 1e-4, 2e-5, 2e-5, 2e-5];
    a.add_prior(camera, &RigidPose::values(&pose), &Covariance::from_sigmas(&sigmas)).unwrap();
    let heights = a.add_group("heights");
    for (x, y) in [(0.0, 1.1), (1.0, 2.9), (2.0, 5.2), (3.0, 6.8)] {
        a.add_observation(heights, LinearObservation::new(y, [(line, [1.0, x])]), &Covariance::from_sigma(0.1))
            .unwrap();
    }
    let printed = a.solve(&SolveOptions::default()).unwrap().to_string();
    let lines: Vec<Vec<&str>> = printed.lines().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(lines[0], ["parameter", "value", "sigma"]);
    assert_eq!(lines[1], ["offset", "1.090", "0.084"]);
    assert_eq!(lines[2], ["slope", "1.940", "0.045"]);
    assert_eq!(lines[3], ["scale", "1.5", "held"]);
    assert_eq!(lines[6], ["camera.tz", "-3.00000", "0.00010"]);
    assert_eq!(lines[9], ["camera.rz", "0.200000", "0.000020"]);
    assert_eq!(lines[10][..5], ["10", "observed", "values,", "redundancy", "2,"]);
    assert!(lines[11][..2] == ["all", "observations:"] && lines[11].contains(&"sigma0"), "{printed}");
    assert!(printed.ends_with("too large for the standard deviations"), "{printed}");
}

#[test]
fn long_tables_are_cut_and_short_of_redundancy_is_said() {
    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean([1.0]).named("x"));
    let y = a.add_block(ParameterBlock::euclidean(vec![0.0; 60]));
    a.add_prior(x, &[2.0e12], &Covariance::from_sigma(3.0e8)).unwrap();
    a.add_prior(y, &[0.0; 60], &Covariance::from_sigmas(&[1.0; 60])).unwrap();
    let printed = a.solve(&SolveOptions::default()).unwrap().to_string();
    assert_eq!(printed.lines().count(), 5, "{printed}");
    assert!(printed.contains("2.00000e12") && printed.contains("3.0e8"), "{printed}");
    assert!(printed.contains("and 60 more") && printed.contains("no redundancy"), "{printed}");
}
