//! What cannot be adjusted is refused with the reason.

use adjust::{
    Adjustment, Covariance, DatumDefect, Error, EvaluationFailure, FunctionObservation, LinearObservation, Method,
    ParameterBlock, RigidPose, Scale, SolveOptions,
};
use nalgebra::Matrix2;

fn solve(a: &Adjustment<'_>) -> Result<adjust::Solution, Error> {
    a.solve(&SolveOptions::default())
}

#[test]
fn nothing_to_adjust() {
    assert_eq!(solve(&Adjustment::new()).unwrap_err(), Error::NoObservations);
    let mut a = Adjustment::new();
    a.add_block(ParameterBlock::euclidean([1.0]));
    assert_eq!(solve(&a).unwrap_err(), Error::NoObservations);
}

#[test]
fn all_held_is_a_solution_without_unknowns() {
    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean([1.0, 2.0]));
    let g = a.add_group("g");
    let o = a.add_observation(g, LinearObservation::new(5.0, [(x, [1.0, 1.0])]), &Covariance::from_sigma(2.0)).unwrap();
    a.hold(x).unwrap();
    let solution = solve(&a).unwrap();
    assert_eq!(solution.unknowns(), 0);
    assert_eq!(solution.residual(o).unwrap(), [2.0]);
    assert_eq!(solution.vtpv(), 1.0);
    assert_eq!(solution.redundancy_numbers(), [1.0]);
    assert_eq!(solution.covariance(x, Scale::Prior).unwrap().norm(), 0.0);
    assert_eq!(solution.diagnosis(0.9).correlated.len(), 0);
}

#[test]
fn unknown_and_foreign_identifiers() {
    let mut other = Adjustment::new();
    let x = other.add_block(ParameterBlock::euclidean([1.0]));
    let g = other.add_group("g");
    let mut a = Adjustment::new();
    let unknown = |error: Error| assert!(matches!(error, Error::UnknownId { .. }), "{error}");
    unknown(a.hold(x).unwrap_err());
    unknown(a.add_observation(g, LinearObservation::new(0.0, [(x, [1.0])]), &Covariance::from_sigma(1.0)).unwrap_err());
    unknown(a.add_constraint(LinearObservation::new(0.0, [(x, [1.0])])).unwrap_err());
    unknown(a.add_prior(x, &[0.0], &Covariance::from_sigma(1.0)).unwrap_err());
    let y = a.add_block(ParameterBlock::euclidean([1.0]));
    unknown(a.hold_parameter(y, 1).unwrap_err());
}

#[test]
fn covariances_that_are_none() {
    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean([1.0, 1.0]));
    let values = [1.0, 1.0];
    for matrix in [
        Matrix2::new(1.0, 2.0, 2.0, 1.0),
        Matrix2::new(1.0, 0.5, 0.1, 1.0),
        Matrix2::new(f64::NAN, 0.0, 0.0, 1.0),
        Matrix2::new(0.0, 0.0, 0.0, 1.0),
        Matrix2::new(-1.0, 0.0, 0.0, 1.0),
    ] {
        let error = a.add_prior(x, &values, &Covariance::from_matrix(&matrix)).unwrap_err();
        assert!(matches!(error, Error::Covariance { .. }), "{error}");
    }
    for sigma in [0.0, -1.0, f64::INFINITY, f64::NAN, 1e-320] {
        let error = a.add_prior(x, &values, &Covariance::from_sigmas(&[sigma, 1.0])).unwrap_err();
        assert!(matches!(error, Error::Covariance { .. }), "{error}");
    }
    assert!(matches!(a.add_prior(x, &values, &Covariance::from_sigma(1.0)).unwrap_err(), Error::Length { .. }));
    assert!(matches!(a.add_prior(x, &[1.0], &Covariance::from_sigma(1.0)).unwrap_err(), Error::Length { .. }));
    // A refused covariance leaves nothing behind.
    a.add_prior(x, &values, &Covariance::from_sigmas(&[1.0, 1.0])).unwrap();
    assert_eq!(solve(&a).unwrap().values(x).unwrap(), values);
}

#[test]
fn start_values_that_are_none() {
    for values in [vec![f64::NAN], vec![f64::INFINITY]] {
        let mut a = Adjustment::new();
        let x = a.add_block(ParameterBlock::euclidean(values).named("x"));
        let g = a.add_group("g");
        a.add_observation(g, LinearObservation::new(0.0, [(x, [1.0])]), &Covariance::from_sigma(1.0)).unwrap();
        assert!(matches!(solve(&a).unwrap_err(), Error::InvalidBlock { block, .. } if block == "x"));
    }
    let mut a = Adjustment::new();
    let pose = a.add_block(ParameterBlock::manifold([0.0; 7], RigidPose));
    let g = a.add_group("g");
    let observation = FunctionObservation::new([pose], 1, |_, _, _| Ok(()));
    a.add_observation(g, observation, &Covariance::from_sigma(1.0)).unwrap();
    assert!(matches!(solve(&a).unwrap_err(), Error::InvalidBlock { .. }));
    assert!(a.set_values(pose, &[0.0; 3]).is_err());
    a.set_values(pose, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]).unwrap();
    assert!(matches!(solve(&a).unwrap_err(), Error::RankDeficient { defect: 6, .. }));
}

#[test]
fn models_that_fail_name_group_and_observation() {
    for method in [Method::GaussNewton, Method::LevenbergMarquardt] {
        for (bad, in_jacobian) in [(f64::NAN, false), (f64::INFINITY, false), (f64::NAN, true)] {
            let mut a = Adjustment::new();
            let x = a.add_block(ParameterBlock::euclidean([1.0]));
            let g = a.add_group("ranges");
            a.add_observation(g, LinearObservation::new(0.0, [(x, [1.0])]), &Covariance::from_sigma(1.0)).unwrap();
            let observation = FunctionObservation::new([x], 2, move |parameters, residual, jacobians| {
                residual[0] = parameters[0][0];
                residual[1] = if in_jacobian { 0.0 } else { bad };
                if let Some(jacobians) = jacobians {
                    jacobians.row(0, 1)[0] = bad;
                }
                Ok(())
            });
            a.add_observation(g, observation, &Covariance::from_sigmas(&[1.0, 1.0])).unwrap();
            let error = a.solve(&SolveOptions { method, ..SolveOptions::default() }).unwrap_err();
            assert!(
                matches!(&error, Error::NotFinite { group, observation: 1, component: 1, .. } if group == "ranges"),
                "{error}"
            );
        }
    }
}

#[test]
fn models_without_value_or_with_wrong_jacobians() {
    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean([1.0]));
    let g = a.add_group("g");
    let fail = FunctionObservation::new([x], 1, |_, _, _| Err(EvaluationFailure::new("behind the camera")));
    a.add_observation(g, fail, &Covariance::from_sigma(1.0)).unwrap();
    assert!(matches!(solve(&a).unwrap_err(), Error::Evaluation { reason, .. } if reason == "behind the camera"));

    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean([1.0]));
    let g = a.add_group("g");
    let wrong = FunctionObservation::new([x], 1, |_, residual, jacobians| {
        residual[0] = 0.0;
        if let Some(jacobians) = jacobians {
            jacobians.set(0, &Matrix2::identity());
            assert!(jacobians.row(1, 0).is_empty());
        }
        Ok(())
    });
    a.add_observation(g, wrong, &Covariance::from_sigma(1.0)).unwrap();
    assert!(matches!(solve(&a).unwrap_err(), Error::Evaluation { .. }));

    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean([1.0]));
    let g = a.add_group("g");
    a.add_observation(g, LinearObservation::new(0.0, [(x, [1.0, 2.0])]), &Covariance::from_sigma(1.0)).unwrap();
    assert!(matches!(solve(&a).unwrap_err(), Error::Evaluation { .. }));
    let empty = FunctionObservation::new([x], 0, |_, _, _| Ok(()));
    assert!(matches!(a.add_observation(g, empty, &Covariance::from_sigmas(&[])).unwrap_err(), Error::Length { .. }));
}

#[test]
fn datum_points_that_carry_none() {
    let mut a = Adjustment::new();
    let points: Vec<_> =
        (0..4).map(|i| a.add_block(ParameterBlock::euclidean([f64::from(i), 2.0 * f64::from(i), 0.0]))).collect();
    let flat = a.add_block(ParameterBlock::euclidean([0.0, 0.0]));
    let g = a.add_group("g");
    a.add_observation(g, LinearObservation::new(0.0, [(flat, [1.0, 1.0])]), &Covariance::from_sigma(1.0)).unwrap();
    let refused = |result: Result<(), Error>| assert!(matches!(result.unwrap_err(), Error::Datum { .. }));
    refused(a.add_inner_constraints(&points[..2], DatumDefect::Six));
    refused(a.add_inner_constraints(&[points[0], points[1], points[1]], DatumDefect::Six));
    refused(a.add_inner_constraints(&[points[0], points[1], flat], DatumDefect::Six));
    a.add_inner_constraints(&points, DatumDefect::Six).unwrap();
    refused(solve(&a).map(|_| ()));
    a.set_values(points[2], &[0.0, 0.0, 7.0]).unwrap();
    a.hold_parameter(points[3], 0).unwrap();
    refused(solve(&a).map(|_| ()));
}

#[test]
fn options_out_of_domain() {
    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean([1.0]));
    let g = a.add_group("g");
    a.add_observation(g, LinearObservation::new(0.0, [(x, [1.0])]), &Covariance::from_sigma(1.0)).unwrap();
    for step_tolerance in [0.0, -1.0, f64::NAN] {
        let options = SolveOptions { step_tolerance, ..SolveOptions::default() };
        assert!(matches!(a.solve(&options).unwrap_err(), Error::Option { name: "step_tolerance", .. }));
    }
    let options = SolveOptions { max_iterations: 0, ..SolveOptions::default() };
    assert!(matches!(a.solve(&options).unwrap_err(), Error::NotConverged { iterations: 0, .. }));
}

#[test]
fn more_unknowns_than_memory_are_refused() {
    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean(vec![0.0; 20_000]));
    let y = a.add_block(ParameterBlock::euclidean([0.0]));
    let g = a.add_group("g");
    a.add_observation(g, LinearObservation::new(0.0, [(y, [1.0])]), &Covariance::from_sigma(1.0)).unwrap();
    assert!(matches!(solve(&a).unwrap_err(), Error::TooLarge { unknowns: 20_001, .. }));
    a.hold(x).unwrap();
    solve(&a).unwrap();
}
