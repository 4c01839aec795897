//! Large networks, whose points are eliminated, against a dense bordered reference.

use crate::common::Distance;
use crate::range_camera;
use crate::range_camera::{
    LABORATORY, PARAMETERS, RangeCameraNetwork, RangeCameraPlan, SIGMAS, TRUTH, range_camera_network,
};
use adjust::{
    Adjustment, Covariance, DatumDefect, Error, FunctionObservation, LinearObservation, Method, ParameterBlock, Scale,
    Solution, SolveOptions, check_jacobian,
};
use approx::assert_relative_eq;
use nalgebra::{DMatrix, DVector, Vector3};

/// Too many rows for the orthogonal factorisation, several pieces in all sums: 1,157 unknowns, 18,000 values.
const WORKSHOP: RangeCameraPlan = RangeCameraPlan {
    seed: 3,
    noise: 0,
    stations: 40,
    targets: 300,
    sightings: 6_000,
    without_range: 0,
    disturbance: 0.005,
};

fn solve(a: &Adjustment<'_>) -> Result<Solution, Error> {
    a.solve(&SolveOptions::default())
}

/// Whitened Jacobian and residuals, at the values of the solution.
fn design(network: &RangeCameraNetwork, solution: &Solution) -> (DMatrix<f64>, DVector<f64>) {
    let column = |block| solution.unknown_index(block, 0).unwrap().unwrap();
    let (mut jacobian, mut right) =
        (DMatrix::zeros(solution.observations(), solution.unknowns()), DVector::zeros(solution.observations()));
    let mut row = 0;
    for (s, t, sighting) in &network.sightings {
        let (station, target) = (network.stations[*s], network.targets[*t]);
        let point = Vector3::from_column_slice(solution.values(target).unwrap());
        let parameters = solution.values(network.parameters).unwrap();
        let (v, a) = sighting.linearise(&solution.pose(station).unwrap(), &point, parameters);
        for i in 0..sighting.dimension {
            right[row] = v[i] / SIGMAS[i];
            for (block, (start, end)) in [(station, (0, 6)), (target, (6, 9)), (network.parameters, (9, 26))] {
                for (k, j) in (start..end).enumerate() {
                    jacobian[(row, column(block) + k)] = a[(i, j)] / SIGMAS[i];
                }
            }
            row += 1;
        }
    }
    (jacobian, right)
}

/// Inner constraints on all targets, as columns.
fn datum(network: &RangeCameraNetwork, solution: &Solution) -> DMatrix<f64> {
    let mut g = DMatrix::zeros(solution.unknowns(), 6);
    for &target in &network.targets {
        let row = solution.unknown_index(target, 0).unwrap().unwrap();
        let p = Vector3::from_column_slice(solution.values(target).unwrap());
        g.fixed_view_mut::<3, 3>(row, 0).fill_with_identity();
        g.fixed_view_mut::<3, 3>(row, 3).copy_from(&-p.cross_matrix());
    }
    g
}

/// Cofactors by inversion of `[N G; Gᵀ 0]`, in unknowns that make the diagonal of N one.
fn bordered(jacobian: &DMatrix<f64>, g: &DMatrix<f64>) -> DMatrix<f64> {
    let (n, k) = (jacobian.ncols(), g.ncols());
    let scale = DVector::from_fn(n, |i, _| 1.0 / jacobian.column(i).norm());
    let scaled = jacobian * DMatrix::from_diagonal(&scale);
    let turned = (DMatrix::from_diagonal(&scale) * g).qr().q();
    let mut whole = DMatrix::zeros(n + k, n + k);
    whole.view_mut((0, 0), (n, n)).copy_from(&scaled.tr_mul(&scaled));
    whole.view_mut((0, n), (n, k)).copy_from(&turned);
    whole.view_mut((n, 0), (k, n)).copy_from(&turned.transpose());
    let inverse = whole.try_inverse().unwrap();
    DMatrix::from_diagonal(&scale) * inverse.view((0, 0), (n, n)) * DMatrix::from_diagonal(&scale)
}

#[test]
fn jacobians_of_sightings_are_right() {
    let network = range_camera_network(&LABORATORY);
    for (s, t, sighting) in network.sightings.iter().step_by(200) {
        let blocks = [
            ParameterBlock::pose(&network.true_stations[*s]),
            ParameterBlock::euclidean(network.true_targets[*t].as_slice()),
            ParameterBlock::euclidean(TRUTH),
        ];
        let check = check_jacobian(sighting, &blocks).unwrap();
        assert!(check.worst < 1e-7, "{check:?}");
    }
}

#[test]
fn the_laboratory_agrees_with_a_dense_bordered_adjustment() {
    for without_range in [0, 7] {
        let network = range_camera_network(&RangeCameraPlan { without_range, ..LABORATORY }).free();
        let solution = solve(&network.adjustment).unwrap();
        assert_eq!(solution.unknowns(), 470);
        let lacking = if without_range > 0 { 1026_usize.div_ceil(without_range) } else { 0 };
        assert_eq!(solution.observations(), 3078 - lacking);
        let (jacobian, v) = design(&network, &solution);
        assert_relative_eq!(v.norm_squared(), solution.vtpv(), max_relative = 1e-13);
        let expected = bordered(&jacobian, &datum(&network, &solution));
        // The reference finds nothing left to do: below 1e-7 of each parameter's standard deviation.
        let step = &expected * jacobian.tr_mul(&v);
        for (dx, q) in step.iter().zip(expected.diagonal().iter()) {
            assert!(dx.abs() < 1e-7 * q.sqrt());
        }
        let reduction = (&jacobian * step).norm_squared();
        assert!(reduction < 1e-13 * solution.vtpv());
        // All blocks, relative to the standard deviations. N has a condition of 1e6 to 1e7: ten digits remain of each.
        let found = solution.covariance_matrix(Scale::Prior).unwrap();
        for column in 0..470 {
            for row in 0..470 {
                let unit = (expected[(row, row)] * expected[(column, column)]).sqrt();
                assert!((found[(row, column)] - expected[(row, column)]).abs() < 1e-8 * unit, "{row} {column}");
            }
        }
        let [station, target] = [network.stations[5], network.targets[17]];
        let between = solution.covariance_between(target, station, Scale::Prior).unwrap();
        let place = |block| solution.unknown_index(block, 0).unwrap().unwrap();
        assert_eq!(between, found.view((place(target), place(station)), (3, 6)).into_owned());
        // Redundancy numbers are those of 1 − diag(J Q Jᵀ), and their sum is the redundancy.
        let numbers = solution.redundancy_numbers();
        let image = &jacobian * &expected;
        for (row, number) in numbers.iter().enumerate() {
            let used: f64 = image.row(row).dot(&jacobian.row(row));
            assert_relative_eq!(*number, 1.0 - used, epsilon = 1e-8);
        }
        assert_relative_eq!(numbers.iter().sum::<f64>(), solution.redundancy() as f64, epsilon = 1e-7);
        assert_eq!(solution.redundancy(), (3078 - lacking) as i64 - 470 + 6);
    }
}

#[test]
fn methods_end_at_the_same_place() {
    let network = range_camera_network(&LABORATORY).free();
    let mut found = Vec::new();
    for method in [Method::LevenbergMarquardt, Method::GaussNewton] {
        let solution = network.adjustment.solve(&SolveOptions { method, ..SolveOptions::default() }).unwrap();
        found.push((solution.vtpv(), solution.covariance(network.parameters, Scale::Prior).unwrap(), solution));
    }
    for (vtpv, covariance, solution) in &found[1..] {
        assert_relative_eq!(*vtpv, found[0].0, max_relative = 1e-12);
        assert_relative_eq!(*covariance, found[0].1, max_relative = 1e-6);
        let deviations = solution.standard_deviations(network.parameters, Scale::Prior).unwrap();
        let values = solution.values(network.parameters).unwrap().iter();
        let others = found[0].2.values(network.parameters).unwrap();
        // Each ends within 1e-8 standard deviations of the solution, and the datum moves by the curvature of the way.
        for ((a, b), sigma) in values.zip(others).zip(deviations) {
            assert!((a - b).abs() < 1e-6 * sigma);
        }
    }
}

#[test]
fn the_number_of_threads_does_not_change_a_bit() {
    let network = range_camera_network(&WORKSHOP).free();
    let run = || {
        let solution = solve(&network.adjustment).unwrap();
        let blocks = network.stations.iter().chain(&network.targets).chain([&network.parameters]);
        let values: Vec<f64> = blocks.clone().flat_map(|&b| solution.values(b).unwrap().to_vec()).collect();
        let deviations: Vec<f64> =
            blocks.flat_map(|&b| solution.standard_deviations(b, Scale::Prior).unwrap()).collect();
        (values, deviations, solution.residuals().to_vec(), solution.redundancy_numbers(), solution.trace().to_vec())
    };
    let in_pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(run);
    let first = in_pool(1);
    assert_eq!(first, in_pool(2));
    assert_eq!(first, in_pool(3));
    // And the sum of all redundancy numbers is the redundancy: 18,000 − 1,157 + 6.
    assert_relative_eq!(first.3.iter().sum::<f64>(), 16_849.0, epsilon = 1e-5);
}

#[test]
fn defects_of_large_networks_are_named() {
    let free = range_camera_network(&WORKSHOP);
    let defect = |a: &Adjustment<'_>| match solve(a).unwrap_err() {
        Error::RankDeficient { defect, combinations } => (defect, combinations),
        error => panic!("{error}"),
    };
    let (count, combinations) = defect(&free.adjustment);
    assert_eq!((count, combinations.len()), (6, 6));
    // A target that a single station sees without a range is not determined along the ray.
    let mut lonely = free.free();
    let far = lonely.true_stations[0].translation.vector - lonely.true_stations[0].rotation * Vector3::z() * 3.0;
    let target = lonely.adjustment.add_block(ParameterBlock::euclidean(far.as_slice()).named("lonely"));
    let (_, _, first) = &lonely.sightings[0];
    let sighting = range_camera::Sighting {
        blocks: [lonely.stations[0], target, lonely.parameters],
        observed: [0.05, -0.03, first.observed[2]],
        at: [0.05, -0.03, first.observed[2]],
        dimension: 2,
    };
    let group = lonely.adjustment.add_group("single");
    lonely.adjustment.add_observation(group, sighting, &Covariance::from_sigmas(&SIGMAS[..2])).unwrap();
    let (count, combinations) = defect(&lonely.adjustment);
    assert_eq!(count, 1);
    assert!(combinations[0].terms.iter().all(|(name, _)| name.starts_with("lonely")), "{:?}", combinations[0]);
    // Two columns of the shared block that act as one.
    let mut doubled = range_camera_network(&WORKSHOP).free();
    let pair = doubled.adjustment.add_block(ParameterBlock::euclidean([0.0; 2]).with_parameter_names(["a", "b"]));
    let group = doubled.adjustment.add_group("sum");
    let sum = LinearObservation::new(1.0, [(pair, [1.0, 1.0])]);
    doubled.adjustment.add_observation(group, sum, &Covariance::from_sigma(1.0)).unwrap();
    let (count, combinations) = defect(&doubled.adjustment);
    assert_eq!(count, 1);
    let names: Vec<&str> = combinations[0].terms.iter().map(|(name, _)| name.as_str()).collect();
    assert!(names.len() == 2 && names.contains(&"a") && names.contains(&"b"));
}

#[test]
fn a_datum_that_would_bend_a_large_network_is_refused() {
    let mut seven = range_camera_network(&LABORATORY);
    seven.adjustment.add_inner_constraints(&seven.targets, DatumDefect::Seven).unwrap();
    let error = solve(&seven.adjustment).unwrap_err();
    assert!(matches!(error, Error::DatumOverdetermined { held: 7, determined: 1, .. }), "{error}");
    let mut control = range_camera_network(&LABORATORY);
    let values = control.adjustment.values(control.targets[4]).unwrap().to_vec();
    control.adjustment.add_prior(control.targets[4], &values, &Covariance::from_sigmas(&[0.01; 3])).unwrap();
    control.adjustment.add_inner_constraints(&control.targets, DatumDefect::Six).unwrap();
    let error = solve(&control.adjustment).unwrap_err();
    assert!(matches!(error, Error::DatumOverdetermined { held: 6, determined: 3, .. }), "{error}");
}

#[test]
fn constraints_keep_their_blocks_from_elimination() {
    let mut network = range_camera_network(&LABORATORY).free();
    let [a, b] = [network.targets[3], network.targets[60]];
    let length = (network.true_targets[3] - network.true_targets[60]).norm();
    let observed = |sigma| {
        let mut weighted = range_camera_network(&LABORATORY).free();
        let group = weighted.adjustment.add_group("bar");
        let bar = Distance { blocks: [a, b], observed: length };
        weighted.adjustment.add_observation(group, bar, &Covariance::from_sigma(sigma)).unwrap();
        solve(&weighted.adjustment).unwrap()
    };
    network.adjustment.add_constraint(Distance { blocks: [a, b], observed: length }).unwrap();
    let solution = solve(&network.adjustment).unwrap();
    let point = |solution: &Solution, id| Vector3::from_column_slice(solution.values(id).unwrap());
    assert_relative_eq!((point(&solution, a) - point(&solution, b)).norm(), length, epsilon = 1e-9);
    assert_eq!(solution.redundancy(), 3078 + 1 + 6 - 470);
    assert_relative_eq!(solution.redundancy_numbers().iter().sum::<f64>(), f64::from(3078 + 7 - 470), epsilon = 1e-6);
    // A constraint is the limit of a good observation: a hundred times better than the network knows the distance.
    let weighted = observed(1e-6);
    let sigma = solution.standard_deviations(network.parameters, Scale::Prior).unwrap();
    for (i, sigma) in sigma.iter().enumerate() {
        let difference =
            solution.values(network.parameters).unwrap()[i] - weighted.values(network.parameters).unwrap()[i];
        assert!(difference.abs() < 1e-2 * sigma);
    }
    let [left, right] = [&solution, &weighted].map(|s| s.covariance(network.parameters, Scale::Prior).unwrap());
    assert_relative_eq!(left, right, max_relative = 1e-2);
}

#[test]
fn a_nonlinear_constraint_that_does_not_hold_at_the_start() {
    let mut network = range_camera_network(&LABORATORY).free();
    let c = network.parameters;
    // The principal distance is held by its square; 8.02 at the start.
    let square = FunctionObservation::new([c], 1, |parameters, residual, jacobians| {
        residual[0] = 64.0 - parameters[0][2].powi(2);
        if let Some(jacobians) = jacobians {
            jacobians.row(0, 0)[2] = 2.0 * parameters[0][2];
        }
        Ok(())
    });
    network.adjustment.add_constraint(square).unwrap();
    for method in [Method::LevenbergMarquardt, Method::GaussNewton] {
        let solution = network.adjustment.solve(&SolveOptions { method, ..SolveOptions::default() }).unwrap();
        assert_relative_eq!(solution.values(c).unwrap()[2], 8.0, epsilon = 1e-10);
        assert!(solution.covariance(c, Scale::Prior).unwrap()[(2, 2)].abs() < 1e-18);
    }
}

#[test]
fn held_parameters_and_near_defects() {
    let mut network = range_camera_network(&LABORATORY).free();
    let whole = solve(&network.adjustment).unwrap();
    let diagnosis = whole.diagnosis(0.9);
    // d0 and the constant parts of the periodic terms share their effect over a few metres.
    assert!(diagnosis.condition > 1e2 && diagnosis.condition < 1e8, "{}", diagnosis.condition);
    assert!(diagnosis.weakest_inflation > 5.0);
    let d0 = diagnosis.correlated.iter().any(|(a, b, _)| [a, b].contains(&&"d0".to_owned()));
    assert!(d0, "{:?}", diagnosis.correlated);
    for component in [3, 9] {
        network.adjustment.hold_parameter(network.parameters, component).unwrap();
    }
    let held = solve(&network.adjustment).unwrap();
    let q = held.covariance(network.parameters, Scale::Prior).unwrap();
    assert_eq!((q[(3, 3)], q[(9, 4)], held.unknowns()), (0.0, 0.0, 468));
    let before = whole.covariance(network.parameters, Scale::Prior).unwrap();
    assert!(q[(8, 8)] < before[(8, 8)] && q[(8, 8)] > 0.0);
    assert!(held.correlation((network.parameters, 3), (network.parameters, 4)).unwrap().is_nan());
}

#[test]
fn parameters_scatter_as_their_covariance_says() {
    // Mean over 40 surveys of eᵀQ⁻¹e / 17: scatters by √(2 / (17 · 40)) = 0.054; four times that.
    let (count, mut sum) = (40, 0.0);
    for seed in 1..=count {
        let plan = RangeCameraPlan { noise: seed, disturbance: 1e-3, ..LABORATORY };
        let network = range_camera_network(&plan).free();
        let solution = solve(&network.adjustment).unwrap();
        let q = solution.covariance(network.parameters, Scale::Prior).unwrap();
        let found = DVector::from_column_slice(solution.values(network.parameters).unwrap());
        let error = found - DVector::from_column_slice(&TRUTH);
        sum += (error.transpose() * q.try_inverse().unwrap() * error)[0];
    }
    assert_relative_eq!(sum / (count as f64 * PARAMETERS as f64), 1.0, epsilon = 0.22);
}
