//! Derivatives by dual numbers against differences.

use nalgebra::{Isometry3, Vector3};
use observation_equations::{
    BlockId, Differentiated, Error, EvaluationFailure, ParameterBlock, Parameters, Real, ResidualFunction,
    check_jacobian,
};

/// A point seen from a camera: tangents of its direction, and its distance.
#[derive(Debug)]
struct Sight;

impl ResidualFunction<3> for Sight {
    fn residual<T: Real>(&self, parameters: &Parameters<'_, T>) -> Result<[T; 3], EvaluationFailure> {
        let [x, y, z] = parameters.pose(0)?.inverse_transform(parameters.values(1)?);
        let distance = (x * x + y * y + z * z).sqrt();
        Ok([-(x / z) + 0.1, -(y / z) - 0.2, -distance + 3.0])
    }
}

#[test]
fn jacobians_agree_with_differences() {
    let pose = Isometry3::new(Vector3::new(0.3, -0.1, 0.2), Vector3::new(0.2, -0.4, 0.1));
    let blocks = [ParameterBlock::pose(&pose), ParameterBlock::euclidean([0.5, 0.4, -3.0])];
    let observation = Differentiated::new(&blocks, [BlockId::new(0), BlockId::new(1)], Sight).unwrap();
    let check = check_jacobian(&observation, &blocks).unwrap();
    assert!(check.worst < 1e-8, "{check:?}");
}

#[test]
fn blocks_that_there_are_not_are_refused() {
    let error = Differentiated::new(&[][..], [BlockId::new(0)], Sight).unwrap_err();
    assert!(matches!(error, Error::UnknownId { index: 0, count: 0, .. }), "{error}");
}
