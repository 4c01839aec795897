//! Linear problems with answers in closed form.

use adjust::{Adjustment, Covariance, Error, LinearObservation, Method, ParameterBlock, Scale, Solution, SolveOptions};
use approx::assert_relative_eq;
use nalgebra::{DMatrix, DVector, Matrix2};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A random design with weights: solved by the crate and by the normal equations written out. The solution of the crate
/// after the comparison, and the sum of squares of the normal equations.
fn check_random(seed: u64, rows: usize, columns: usize, method: Method) -> (Solution, f64) {
    let mut rng = Pcg64::seed_from_u64(seed);
    let design = DMatrix::from_fn(rows, columns, |_, _| rng.random_range(-1.0..1.0));
    let observed = DVector::from_fn(rows, |_, _| rng.random_range(-10.0..10.0));
    let sigmas = DVector::from_fn(rows, |_, _| rng.random_range(0.1..3.0));
    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean(vec![0.0; columns]));
    let g = a.add_group("g");
    for row in 0..rows {
        let coefficients: Vec<f64> = design.row(row).iter().copied().collect();
        let observation = LinearObservation::new(observed[row], [(x, coefficients)]);
        a.add_observation(g, observation, &Covariance::from_sigma(sigmas[row])).unwrap();
    }
    let solution = a.solve(&SolveOptions { method, ..SolveOptions::default() }).unwrap();

    let weights = DMatrix::from_diagonal(&sigmas.map(|s| 1.0 / (s * s)));
    let cofactor = (design.transpose() * &weights * &design).try_inverse().unwrap();
    let expected = &cofactor * design.transpose() * &weights * &observed;
    let residuals = &observed - &design * &expected;
    let redundancy = DMatrix::identity(rows, rows) - &design * &cofactor * design.transpose() * &weights;
    // A random design of 3 to 8 columns has a condition of at most some 1e3: ten digits remain.
    assert_relative_eq!(
        DVector::from_column_slice(solution.values(x).unwrap()),
        expected,
        max_relative = 1e-9,
        epsilon = 1e-9
    );
    let covariance = solution.covariance(x, Scale::Prior).unwrap();
    assert_relative_eq!(covariance, cofactor, max_relative = 1e-8, epsilon = 1e-10);
    assert_eq!(solution.covariance_matrix(Scale::Prior).unwrap(), covariance);
    let vtpv = (residuals.transpose() * &weights * &residuals)[0];
    assert_relative_eq!(solution.vtpv(), vtpv, max_relative = 1e-9);
    let numbers = solution.redundancy_numbers();
    for row in 0..rows {
        assert_relative_eq!(numbers[row], redundancy[(row, row)], epsilon = 1e-9);
        assert_relative_eq!(solution.residuals()[row], residuals[row], epsilon = 1e-8);
    }
    assert_relative_eq!(numbers.iter().sum::<f64>(), solution.redundancy() as f64, epsilon = 1e-9);
    let w = solution.standardised_residuals(Scale::Prior).unwrap();
    for row in 0..rows {
        let expected = residuals[row] / (sigmas[row] * redundancy[(row, row)].sqrt());
        assert_relative_eq!(w[row], expected, max_relative = 1e-6, epsilon = 1e-6);
    }
    let sigma0 = solution.sigma0().unwrap();
    assert_relative_eq!(sigma0 * sigma0, vtpv / (rows - columns) as f64, max_relative = 1e-9);
    let posterior = solution.covariance(x, Scale::Posterior).unwrap();
    assert_relative_eq!(posterior, covariance * (sigma0 * sigma0), max_relative = 1e-12);
    (solution, vtpv)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn random_designs_agree_with_the_closed_form(seed in 0_u64..1000, columns in 1_usize..8, extra in 5_usize..20) {
        let (full, expected) = check_random(seed, columns + extra, columns, Method::GaussNewton);
        let (damped, _) = check_random(seed, columns + extra, columns, Method::LevenbergMarquardt);
        prop_assert_eq!((full.unknowns(), full.redundancy()), (columns, extra as i64));
        prop_assert!((full.vtpv() - damped.vtpv()).abs() < 1e-9 * expected, "{} {}", full.vtpv(), damped.vtpv());
        // A linear problem is solved by its first full step; the second is rounding.
        prop_assert!(full.iterations() <= 2, "{:?}", full.trace());
    }
}

/// Two correlated observations of one unknown, v = b − x.
fn correlated() -> (Solution, Matrix2<f64>, adjust::BlockId) {
    let covariance = Matrix2::new(4.0, 1.5, 1.5, 1.0);
    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean([0.0, 0.0]));
    let values = [[1.0, 2.0], [2.0, 1.5], [0.5, 3.0]];
    for value in values {
        a.add_prior(x, &value, &Covariance::from_matrix(&covariance)).unwrap();
    }
    (a.solve(&SolveOptions::default()).unwrap(), covariance, x)
}

#[test]
fn correlated_observations_have_their_full_weight() {
    let (solution, covariance, x) = correlated();
    // Three vectors with the same covariance: the mean, and a third of the covariance.
    assert_relative_eq!(solution.values(x).unwrap()[0], 3.5 / 3.0, epsilon = 1e-14);
    let found = solution.covariance(x, Scale::Prior).unwrap();
    assert_relative_eq!(found, DMatrix::from_iterator(2, 2, (covariance / 3.0).iter().copied()), epsilon = 1e-14);
    // Each redundancy number is 1 − 1/3, whatever the correlation.
    for number in solution.redundancy_numbers() {
        assert_relative_eq!(number, 2.0 / 3.0, epsilon = 1e-13);
    }
    // Q_vv = C (1 − 1/3).
    let deviations = solution.residual_deviations(Scale::Prior).unwrap();
    assert_relative_eq!(deviations[0], (4.0_f64 * 2.0 / 3.0).sqrt(), epsilon = 1e-13);
    assert_relative_eq!(deviations[1], (2.0_f64 / 3.0).sqrt(), epsilon = 1e-13);
}

#[test]
fn a_prior_alone_gives_itself_back() {
    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean([5.0, 5.0]));
    let covariance = Matrix2::new(2.0, 0.3, 0.3, 1.0);
    a.add_prior(x, &[1.0, 2.0], &Covariance::from_matrix(&covariance)).unwrap();
    let solution = a.solve(&SolveOptions::default()).unwrap();
    assert_relative_eq!(solution.values(x).unwrap()[1], 2.0, epsilon = 1e-14);
    assert_relative_eq!(solution.covariance(x, Scale::Prior).unwrap()[(0, 1)], 0.3, epsilon = 1e-14);
    assert_eq!((solution.redundancy(), solution.sigma0()), (0, None));
    assert_eq!(solution.covariance(x, Scale::Posterior).unwrap_err(), Error::NoRedundancy { redundancy: 0 });
    assert!(solution.standardised_residuals(Scale::Prior).unwrap().iter().all(|w| w.is_nan()));
    let prior = a.prior_group();
    assert_eq!(a.solve(&SolveOptions::default()).unwrap().group(prior).unwrap().sigma0(), None);
}

#[test]
fn held_parameters_are_no_unknowns() {
    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean([3.0, 10.0]).named("x"));
    let g = a.add_group("g");
    for (observed, row) in [(15.0, [1.0, 1.0]), (17.0, [2.0, 1.0])] {
        a.add_observation(g, LinearObservation::new(observed, [(x, row)]), &Covariance::from_sigma(1.0)).unwrap();
    }
    a.hold_parameter(x, 1).unwrap();
    let solution = a.solve(&SolveOptions::default()).unwrap();
    // With x1 = 10: the mean of (5, 7/2) weighted 1 : 4.
    assert_relative_eq!(solution.values(x).unwrap()[0], (5.0 + 2.0 * 7.0) / 5.0, epsilon = 1e-14);
    assert_eq!(solution.values(x).unwrap()[1], 10.0);
    assert_eq!(solution.unknown_names(), ["x.0"]);
    assert_eq!(solution.unknown_index(x, 1).unwrap(), None);
    let covariance = solution.covariance(x, Scale::Prior).unwrap();
    assert_relative_eq!(covariance[(0, 0)], 0.2, epsilon = 1e-15);
    assert_eq!((covariance[(0, 1)], covariance[(1, 1)]), (0.0, 0.0));
    assert!(solution.correlation((x, 0), (x, 1)).unwrap().is_nan());
    a.release(x).unwrap();
    assert_relative_eq!(a.solve(&SolveOptions::default()).unwrap().values(x).unwrap()[1], 13.0, epsilon = 1e-12);
}

#[test]
fn constraints_hold_exactly_and_reduce_the_covariance() {
    // Three angles of a triangle, equal weights: the misclosure is shared, each variance becomes 2/3.
    let mut a = Adjustment::new();
    let angles = a.add_block(ParameterBlock::euclidean([0.0; 3]));
    let observed = [60.3, 59.9, 60.1];
    a.add_prior(angles, &observed, &Covariance::from_sigmas(&[0.1; 3])).unwrap();
    a.add_constraint(LinearObservation::new(180.0, [(angles, [1.0; 3])])).unwrap();
    let solution = a.solve(&SolveOptions::default()).unwrap();
    for (angle, observed) in solution.values(angles).unwrap().iter().zip(observed) {
        assert_relative_eq!(*angle, observed - 0.1, epsilon = 1e-12);
    }
    assert_eq!(solution.redundancy(), 1);
    let covariance = solution.covariance(angles, Scale::Prior).unwrap();
    assert_relative_eq!(covariance[(0, 0)], 0.01 * 2.0 / 3.0, epsilon = 1e-15);
    assert_relative_eq!(covariance[(0, 1)], -0.01 / 3.0, epsilon = 1e-15);
    assert_relative_eq!(solution.redundancy_numbers().iter().sum::<f64>(), 1.0, epsilon = 1e-12);
    // The same constraint again says nothing new.
    a.add_constraint(LinearObservation::new(360.0, [(angles, [2.0; 3])])).unwrap();
    assert_eq!(a.solve(&SolveOptions::default()).unwrap_err(), Error::DependentConstraint { index: 1 });
}

#[test]
fn undetermined_combinations_are_named() {
    // Only offset + 2 slope and drift are observed.
    let mut a = Adjustment::new();
    let line = a.add_block(ParameterBlock::euclidean([0.0; 2]).with_parameter_names(["offset", "slope"]));
    let drift = a.add_block(ParameterBlock::euclidean([0.0]).named("drift"));
    let unseen = a.add_block(ParameterBlock::euclidean([0.0]).named("unseen"));
    let g = a.add_group("g");
    for value in [1.0, 1.1, 0.9, 1.05] {
        let observation = LinearObservation::new(value, [(line, vec![1.0, 2.0]), (drift, vec![value])]);
        a.add_observation(g, observation, &Covariance::from_sigma(0.1)).unwrap();
    }
    for method in [Method::GaussNewton, Method::LevenbergMarquardt] {
        let error = a.solve(&SolveOptions { method, ..SolveOptions::default() }).unwrap_err();
        let Error::RankDeficient { defect, combinations } = &error else { panic!("{error}") };
        assert_eq!(*defect, 2);
        let named: Vec<Vec<&str>> =
            combinations.iter().map(|c| c.terms.iter().map(|(name, _)| name.as_str()).collect()).collect();
        assert!(named.contains(&vec!["unseen"]), "{error}");
        assert!(
            named.iter().any(|names| names.len() == 2 && names.contains(&"offset") && names.contains(&"slope")),
            "{error}"
        );
        // Columns of unit length: both weights are of the same size and opposite sign.
        let pair = combinations.iter().find(|c| c.terms.len() == 2).unwrap();
        assert_relative_eq!(pair.terms[0].1 * pair.terms[1].1, -1.0, epsilon = 1e-9);
    }
    a.hold(unseen).unwrap();
    a.add_prior(line, &[0.0, 0.0], &Covariance::from_sigmas(&[1.0, 1.0])).unwrap();
    // These observations fit exactly: no smaller and smaller objective is chased.
    let solution = a.solve(&SolveOptions::default()).unwrap();
    assert!(solution.iterations() < 20, "{}", solution.iterations());
}

#[test]
fn more_unknowns_than_observations() {
    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean([0.0; 5]).named("x"));
    let g = a.add_group("g");
    a.add_observation(g, LinearObservation::new(1.0, [(x, [1.0; 5])]), &Covariance::from_sigma(1.0)).unwrap();
    assert!(matches!(a.solve(&SolveOptions::default()).unwrap_err(), Error::RankDeficient { defect: 4, .. }));
}

#[test]
fn near_defects_are_diagnosed() {
    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean([0.0; 3]).with_parameter_names(["d0", "z", "c"]));
    let g = a.add_group("g");
    for i in 0..20 {
        let t = f64::from(i);
        let row = [1.0, 1.0 + 1e-4 * (t * 0.7).sin(), t];
        a.add_observation(g, LinearObservation::new(t, [(x, row)]), &Covariance::from_sigma(1.0)).unwrap();
    }
    let diagnosis = a.solve(&SolveOptions::default()).unwrap().diagnosis(0.95);
    assert!(diagnosis.condition > 1e4);
    let worst: Vec<&str> = diagnosis.weakest.terms.iter().map(|(name, _)| name.as_str()).collect();
    assert!(worst.len() == 2 && worst.contains(&"d0") && worst.contains(&"z"), "{:?}", diagnosis.weakest);
    assert!(diagnosis.weakest_inflation > 1e3);
    assert_eq!((diagnosis.correlated[0].0.as_str(), diagnosis.correlated[0].1.as_str()), ("d0", "z"));
    assert!(diagnosis.correlated[0].2 < -0.999);
}
