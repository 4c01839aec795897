//! Derivatives by dual numbers: exact to rounding, and the same solution as with a Jacobian derived by hand.

use adjust::{
    Adjustment, Differentiated, Error, Euclidean, EvaluationFailure, Manifold, Observation, ParameterBlock, Parameters,
    Real, ResidualFunction, Scale, SolveOptions, check_jacobian,
};
use approx::assert_relative_eq;
use nalgebra::{Isometry3, Point3, Vector3};

use crate::differentiated_camera::differentiated;
use crate::range_camera::{LABORATORY, range_camera_network};

/// A point and a direction in two frames, with all ways of a pose.
struct Both {
    forth: bool,
}

impl ResidualFunction<6> for Both {
    fn residual<T: Real>(&self, parameters: &Parameters<'_, T>) -> Result<[T; 6], EvaluationFailure> {
        let (pose, point) = (parameters.pose(0)?, parameters.values(1)?);
        let (a, b) = if self.forth {
            (pose.transform(point), pose.rotate(point))
        } else {
            (pose.inverse_transform(point), pose.inverse_rotate(point))
        };
        Ok([a[0], a[1], a[2], b[0], b[1], b[2]])
    }
}

#[test]
fn poses_turn_points_and_their_derivatives() {
    let pose = Isometry3::new(Vector3::new(0.3, -2.0, 1.0), Vector3::new(0.4, 2.0, -1.1));
    let point = Point3::new(0.7, -0.2, 3.0);
    let blocks = [ParameterBlock::pose(&pose), ParameterBlock::euclidean(point.coords.as_slice())];
    let mut a = Adjustment::new();
    let ids = blocks.clone().map(|block| a.add_block(block));
    for (forth, expected, turned) in
        [(true, pose * point, pose * point.coords), (false, pose.inverse() * point, pose.inverse() * point.coords)]
    {
        let observation = Differentiated::new(&a, ids, Both { forth }).unwrap();
        let mut residual = [0.0; 6];
        let values = ids.map(|id| a.values(id).unwrap());
        observation.evaluate(&values, &mut residual, None).unwrap();
        let expected = [expected.x, expected.y, expected.z, turned.x, turned.y, turned.z];
        assert_relative_eq!(residual.as_slice(), expected.as_slice(), epsilon = 1e-14);
        let check = check_jacobian(&observation, &blocks).unwrap();
        // Differences are good to 1e-7 or better.
        assert!(check.worst < 1e-8, "{check:?}");
    }
}

#[test]
fn a_calibration_is_the_same_as_with_a_jacobian_by_hand() {
    let network = range_camera_network(&LABORATORY).free();
    let dual = differentiated(&network).solve(&SolveOptions::default()).unwrap();
    let hand = network.adjustment.solve(&SolveOptions::default()).unwrap();
    assert_relative_eq!(dual.vtpv(), hand.vtpv(), max_relative = 1e-12);
    assert_eq!(dual.iterations(), hand.iterations());
    for &block in network.stations.iter().chain(&network.targets).chain([&network.parameters]) {
        let (found, expected) = (dual.values(block).unwrap(), hand.values(block).unwrap());
        let sigmas = hand.standard_deviations(block, Scale::Prior).unwrap();
        for ((found, expected), sigma) in found.iter().zip(expected).zip(&sigmas) {
            assert!((found - expected).abs() < 1e-6 * sigma, "{found} {expected} {sigma}");
        }
        let found = dual.standard_deviations(block, Scale::Prior).unwrap();
        assert_relative_eq!(found.as_slice(), sigmas.as_slice(), max_relative = 1e-8);
    }
}

/// Takes its only block for three plain numbers.
#[derive(Debug)]
struct Three;

impl ResidualFunction<1> for Three {
    fn residual<T: Real>(&self, parameters: &Parameters<'_, T>) -> Result<[T; 1], EvaluationFailure> {
        let [x, y, z] = parameters.values(0)?;
        Ok([x + y + z])
    }
}

/// Plain numbers that say otherwise.
#[derive(Debug)]
struct Curved;

impl Manifold for Curved {
    fn ambient_dimension(&self) -> usize {
        3
    }
    fn tangent_dimension(&self) -> usize {
        3
    }
    fn plus(&self, values: &[f64], step: &[f64], out: &mut [f64]) {
        Euclidean(3).plus(values, step, out);
    }
    fn minus(&self, values: &[f64], reference: &[f64], out: &mut [f64]) {
        Euclidean(3).minus(values, reference, out);
    }
}

#[test]
fn blocks_that_do_not_fit_are_refused() {
    let mut a = Adjustment::new();
    let three = a.add_block(ParameterBlock::euclidean([0.0; 3]));
    let two = a.add_block(ParameterBlock::euclidean([0.0; 2]));
    let pose = a.add_block(ParameterBlock::pose(&Isometry3::identity()));
    let curved = a.add_block(ParameterBlock::manifold([0.0; 3], Curved).named("bend"));
    assert!(Differentiated::new(&a, [three], Three).is_ok());
    let error = Error::from(Differentiated::new(&a, [curved], Three).unwrap_err());
    assert!(matches!(&error, Error::Untestable { what, .. } if what.contains("bend")), "{error}");
    for (block, values) in [(two, vec![0.0; 2]), (pose, vec![0.0; 7])] {
        let observation = Differentiated::new(&a, [block], Three).unwrap();
        let failure = observation.evaluate(&[&values], &mut [0.0], None).unwrap_err();
        assert!(failure.to_string().contains("3 plain numbers"), "{failure}");
    }
}
