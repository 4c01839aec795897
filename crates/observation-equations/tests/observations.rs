//! Observations by design rows and closures, covariances, and what is refused.

use observation_equations::{
    BlockId, Covariance, Error, FunctionObservation, Jacobians, LinearObservation, Observation, ParameterBlock,
    check_jacobian,
};

#[test]
fn a_linear_observation_is_its_design_row() {
    let observation = LinearObservation::new(5.0, [(BlockId::new(0), [2.0, -1.0])]);
    let mut residual = [0.0];
    observation.evaluate(&[&[1.0, 3.0]], &mut residual, None).unwrap();
    assert!((residual[0] - 6.0).abs() < 1e-15);
    let check = check_jacobian(&observation, &[ParameterBlock::euclidean([1.0, 3.0])]).unwrap();
    assert!(check.worst < 1e-9, "{check:?}");
    assert!(observation.evaluate(&[&[1.0]], &mut residual, None).is_err(), "a block of another length");
}

#[test]
fn a_jacobian_of_the_wrong_shape_is_refused() {
    let wrong = |_: &[&[f64]], residual: &mut [f64], jacobians: Option<&mut Jacobians<'_>>| {
        residual[0] = 0.0;
        if let Some(jacobians) = jacobians {
            assert!(jacobians.row(0, 1).is_empty(), "there is one row only");
        }
        Ok(())
    };
    let observation = FunctionObservation::new([BlockId::new(0)], 1, wrong);
    let error = check_jacobian(&observation, &[ParameterBlock::euclidean([1.0])]).unwrap_err();
    assert!(error.to_string().contains("wrong shape"), "{error}");
}

#[test]
fn covariances_are_whitened_or_refused() {
    let mut whitening = Vec::new();
    Covariance::from_sigmas(&[0.5, 2.0]).whitening("ranges", 2, &mut whitening).unwrap();
    assert_eq!(whitening.len(), 3);
    assert!((whitening[0] - 2.0).abs() < 1e-15 && (whitening[2] - 0.5).abs() < 1e-15, "{whitening:?}");
    let refused = Covariance::from_sigma(-1.0).whitening("ranges", 1, &mut whitening);
    assert!(matches!(refused, Err(Error::Covariance { .. })));
    assert!(matches!(Covariance::from_sigma(1.0).whitening("ranges", 2, &mut whitening), Err(Error::Length { .. })));
}

#[test]
fn parameters_have_names() {
    let block = ParameterBlock::euclidean([1.0, 2.0]).named("k").with_parameter_names(["k1"]);
    assert_eq!([block.parameter_name(0, 0), block.parameter_name(0, 1)], ["k1", "k.1"]);
    assert!(block.check(0, &[1.0]).is_err() && block.check(0, &[1.0, f64::NAN]).is_err());
}
