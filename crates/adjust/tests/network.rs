//! Free networks of stations and points: datum, rank, covariance.

use crate::common::{Distance, Network, Plan, Sight, network};
use adjust::{
    Adjustment, Covariance, DatumDefect, Error, Manifold, ParameterBlock, RigidPose, Scale, Solution, SolveOptions,
    check_jacobian,
};
use approx::assert_relative_eq;
use nalgebra::{DMatrix, DVector, Isometry3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const PLAN: Plan = Plan { seed: 7, stations: 4, points: 9, seen: 9, ranges: true, disturbance: 0.02 };

fn solve(a: &Adjustment<'_>) -> Result<Solution, Error> {
    a.solve(&SolveOptions::default())
}

fn trace_over(solution: &Solution, points: &[adjust::BlockId]) -> f64 {
    points.iter().map(|&p| solution.covariance(p, Scale::Prior).unwrap().trace()).sum()
}

#[test]
fn jacobians_of_the_models_are_right() {
    let network = network(&PLAN);
    let points = [ParameterBlock::euclidean([0.1, 0.7, -0.4]), ParameterBlock::euclidean([1.3, 0.2, 0.9])];
    let distance = Distance { blocks: [network.points[0], network.points[1]], observed: 1.0 };
    assert!(check_jacobian(&distance, &points).unwrap().worst < 1e-8);
    let pose = ParameterBlock::pose(&network.true_stations[1]);
    let sight = Sight { blocks: [network.stations[1], network.points[0]], observed: [0.0; 3] };
    let check = check_jacobian(&sight, &[pose, points[0].clone()]).unwrap();
    assert!(check.worst < 1e-8, "{check:?}");
    assert!(check_jacobian(&sight, &points).is_err());
}

#[test]
fn inner_constraints_on_all_points_of_a_distance_network_give_the_pseudo_inverse() {
    let mut rng = Pcg64::seed_from_u64(3);
    let truth: Vec<Vector3<f64>> = (0..7).map(|_| Vector3::from_fn(|_, _| rng.random_range(-2.0..2.0))).collect();
    let mut a = Adjustment::new();
    let points: Vec<_> = truth.iter().map(|p| a.add_block(ParameterBlock::euclidean(p.as_slice()))).collect();
    let group = a.add_group("distances");
    let n = 3 * truth.len();
    let mut rows = Vec::new();
    for i in 0..truth.len() {
        for j in 0..i {
            let between = truth[j] - truth[i];
            let observed = between.norm();
            a.add_observation(
                group,
                Distance { blocks: [points[i], points[j]], observed },
                &Covariance::from_sigma(0.01),
            )
            .unwrap();
            let mut row = DVector::zeros(n);
            row.fixed_rows_mut::<3>(3 * i).copy_from(&(-between / observed / 0.01));
            row.fixed_rows_mut::<3>(3 * j).copy_from(&(between / observed / 0.01));
            rows.push(row);
        }
    }
    a.add_inner_constraints(&points, DatumDefect::Six).unwrap();
    let solution = solve(&a).unwrap();
    let design = DMatrix::from_columns(&rows);
    // Eigenvalues of N are 1e4 and larger, or zero up to 1e-10.
    let expected = (&design * design.transpose()).pseudo_inverse(1.0).unwrap();
    assert_relative_eq!(solution.covariance_matrix(Scale::Prior).unwrap(), expected, epsilon = 1e-13);
    assert_eq!(solution.redundancy(), 6);
    assert_relative_eq!(solution.redundancy_numbers().iter().sum::<f64>(), 6.0, epsilon = 1e-9);
    // Exact observations, exact start: nothing moves.
    for (point, truth) in points.iter().zip(&truth) {
        assert_relative_eq!(Vector3::from_column_slice(solution.values(*point).unwrap()), *truth, epsilon = 1e-13);
    }
}

/// `S N⁻ Sᵀ` with `S = I − H (GᵀH)⁻¹ Gᵀ`: the cofactor matrix in the datum of G, from the matrix in any other datum.
/// H is the null space of N, G acts on points only.
fn transformed(other: &DMatrix<f64>, solution: &Solution, network: &Network, defect: usize) -> DMatrix<f64> {
    let n = other.nrows();
    let (mut h, mut g) = (DMatrix::zeros(n, defect), DMatrix::zeros(n, defect));
    let motion = |i: usize, p: &Vector3<f64>| match i {
        0..3 => Vector3::from_fn(|r, _| f64::from(u8::from(r == i))),
        3..6 => Vector3::from_fn(|r, _| f64::from(u8::from(r == i - 3))).cross(p),
        _ => *p,
    };
    for i in 0..defect {
        for &point in &network.points {
            let row = solution.unknown_index(point, 0).unwrap().unwrap();
            let p = Vector3::from_column_slice(solution.values(point).unwrap());
            h.fixed_view_mut::<3, 1>(row, i).copy_from(&motion(i, &p));
            g.fixed_view_mut::<3, 1>(row, i).copy_from(&motion(i, &p));
        }
        for &station in &network.stations {
            let row = solution.unknown_index(station, 0).unwrap().unwrap();
            let pose = solution.pose(station).unwrap();
            h.fixed_view_mut::<3, 1>(row, i).copy_from(&motion(i, &pose.translation.vector));
            if (3..6).contains(&i) {
                let turn = pose.rotation.inverse() * motion(i - 3, &Vector3::zeros());
                h.fixed_view_mut::<3, 1>(row + 3, i).copy_from(&turn);
            }
        }
    }
    let s = DMatrix::identity(n, n) - &h * (g.transpose() * &h).try_inverse().unwrap() * g.transpose();
    &s * other * s.transpose()
}

#[test]
fn inner_constraints_on_points_agree_with_an_s_transformation() {
    for (ranges, defect) in [(true, DatumDefect::Six), (false, DatumDefect::Seven)] {
        let mut free = network(&Plan { ranges, ..PLAN });
        let points = free.points.clone();
        free.adjustment.add_inner_constraints(&points[..4], defect).unwrap();
        let part = solve(&free.adjustment).unwrap();
        // The same network adjusted again from the first solution, so that both are linearised at one place.
        for &block in free.points.iter().chain(&free.stations) {
            free.adjustment.set_values(block, part.values(block).unwrap()).unwrap();
        }
        free.adjustment.add_inner_constraints(&points, defect).unwrap();
        let all = solve(&free.adjustment).unwrap();
        let expected = transformed(&part.covariance_matrix(Scale::Prior).unwrap(), &all, &free, defect.count());
        let found = all.covariance_matrix(Scale::Prior).unwrap();
        // Variances are some 1e-6; conditions of 1e3 leave ten digits of them, and the two stop 1e-8 sigma apart.
        assert_relative_eq!(found, expected, epsilon = 1e-13);
        // v'Pv does not depend on the datum, the trace does and is smallest here.
        assert_relative_eq!(all.vtpv(), part.vtpv(), max_relative = 1e-12);
        assert!(trace_over(&all, &points) < trace_over(&part, &points));
        let rows = if ranges { 3 } else { 2 } * 36;
        assert_eq!(all.redundancy(), rows - 51 + defect.count() as i64);
        assert_relative_eq!(all.redundancy_numbers().iter().sum::<f64>(), all.redundancy() as f64, epsilon = 1e-8);
    }
}

#[test]
fn a_held_station_is_another_datum_of_the_same_network() {
    let mut held = network(&PLAN);
    held.adjustment.hold(held.stations[0]).unwrap();
    let held_solution = solve(&held.adjustment).unwrap();
    let mut free = network(&PLAN);
    let points = free.points.clone();
    free.adjustment.add_inner_constraints(&points, DatumDefect::Six).unwrap();
    let solution = solve(&free.adjustment).unwrap();
    assert_relative_eq!(solution.vtpv(), held_solution.vtpv(), max_relative = 1e-12);
    assert_eq!(solution.redundancy(), held_solution.redundancy());
    for (a, b) in solution.redundancy_numbers().iter().zip(held_solution.redundancy_numbers()) {
        assert_relative_eq!(*a, b, epsilon = 1e-9);
    }
    assert!(trace_over(&solution, &points) < trace_over(&held_solution, &points));
}

#[test]
fn defects_are_counted_and_named() {
    let defect_of = |network: &Network| match solve(&network.adjustment).unwrap_err() {
        Error::RankDeficient { defect, combinations } => {
            assert_eq!(combinations.len(), defect);
            assert!(combinations.iter().all(|c| !c.terms.is_empty()));
            defect
        }
        error => panic!("{error}"),
    };
    assert_eq!(defect_of(&network(&PLAN)), 6);
    let directions = Plan { ranges: false, ..PLAN };
    assert_eq!(defect_of(&network(&directions)), 7);
    let mut six = network(&directions);
    let points = six.points.clone();
    six.adjustment.add_inner_constraints(&points, DatumDefect::Six).unwrap();
    assert_eq!(defect_of(&six), 1);
    // A scale bar cures it.
    let group = six.adjustment.add_group("scale bar");
    let observed = (six.true_points[0] - six.true_points[1]).norm();
    let bar = Distance { blocks: [points[0], points[1]], observed };
    six.adjustment.add_observation(group, bar, &Covariance::from_sigma(0.0005)).unwrap();
    let solution = solve(&six.adjustment).unwrap();
    assert_relative_eq!(solution.group(group).unwrap().redundancy, 0.0, epsilon = 1e-6);
}

#[test]
fn a_datum_that_would_bend_the_network_is_refused() {
    let mut seven = network(&PLAN);
    let points = seven.points.clone();
    seven.adjustment.add_inner_constraints(&points, DatumDefect::Seven).unwrap();
    let error = solve(&seven.adjustment).unwrap_err();
    assert!(matches!(error, Error::DatumOverdetermined { held: 7, determined: 1, .. }), "{error}");
    // A weighted point is control: it and the inner constraints contradict.
    let mut control = network(&PLAN);
    let values = control.adjustment.values(points[0]).unwrap().to_vec();
    control.adjustment.add_prior(points[0], &values, &Covariance::from_sigmas(&[0.01; 3])).unwrap();
    control.adjustment.add_inner_constraints(&points, DatumDefect::Six).unwrap();
    let error = solve(&control.adjustment).unwrap_err();
    assert!(matches!(error, Error::DatumOverdetermined { held: 6, determined: 3, .. }), "{error}");
}

#[test]
fn a_larger_network_is_decided_on_its_normal_equations() {
    // 7 · 6 + 40 · 3 = 162 unknowns, 840 rows: too large to be factorised orthogonally as a matter of course.
    let plan = Plan { stations: 7, points: 40, seen: 40, ..PLAN };
    let mut free = network(&plan);
    assert!(matches!(solve(&free.adjustment).unwrap_err(), Error::RankDeficient { defect: 6, .. }));
    let points = free.points.clone();
    free.adjustment.add_inner_constraints(&points, DatumDefect::Six).unwrap();
    let solution = solve(&free.adjustment).unwrap();
    assert_relative_eq!(solution.redundancy_numbers().iter().sum::<f64>(), f64::from(840 - 162 + 6), epsilon = 1e-7);
    // 684 degrees of freedom: σ₀ is 1 within 4 · 1/√(2·684) = 0.11.
    assert_relative_eq!(solution.sigma0().unwrap(), 1.0, epsilon = 0.11);
    let w = solution.standardised_residuals(Scale::Prior).unwrap();
    let mean_square = w.iter().map(|w| w * w).sum::<f64>() / w.len() as f64;
    assert_relative_eq!(mean_square, 1.0, epsilon = 0.22);
    assert!(solution.diagnosis(0.9).condition < 1e5);
}

#[test]
fn covariances_agree_with_repeated_simulation() {
    // The mean of eᵀQ⁺e over 200 networks has the expectation rank(Q); it scatters by √(2·rank/200), 1.4 % here.
    let (mut sum, mut sigma0) = (0.0, 0.0);
    let count = 200;
    let rank = 4 * 6 + 8 * 3 - 6;
    for seed in 0..count {
        let mut n =
            network(&Plan { seed: 1000 + seed, stations: 4, points: 8, seen: 8, ranges: true, disturbance: 0.0 });
        let points = n.points.clone();
        n.adjustment.add_inner_constraints(&points, DatumDefect::Six).unwrap();
        let solution = solve(&n.adjustment).unwrap();
        let mut error = DVector::zeros(solution.unknowns());
        for (id, truth) in n.points.iter().zip(&n.true_points) {
            let row = solution.unknown_index(*id, 0).unwrap().unwrap();
            let found = Vector3::from_column_slice(solution.values(*id).unwrap());
            error.fixed_rows_mut::<3>(row).copy_from(&(found - truth));
        }
        for (id, truth) in n.stations.iter().zip(&n.true_stations) {
            let row = solution.unknown_index(*id, 0).unwrap().unwrap();
            let mut out = [0.0; 6];
            RigidPose.minus(solution.values(*id).unwrap(), &RigidPose::values(truth), &mut out);
            error.rows_mut(row, 6).copy_from_slice(&out);
        }
        let q = solution.covariance_matrix(Scale::Prior).unwrap();
        // Variances are 1e-7 to 1e-5, the six zeros are 1e-20.
        let inverse = q.pseudo_inverse(1e-14).unwrap();
        sum += (error.transpose() * inverse * error)[0];
        sigma0 += solution.vtpv() / solution.redundancy() as f64;
    }
    // Four times the scatter, and as much again for the curvature of the model (sigmas are 1e-3 of the distances).
    assert_relative_eq!(sum / (count as f64 * f64::from(rank)), 1.0, epsilon = 0.06);
    assert_relative_eq!(sigma0 / count as f64, 1.0, epsilon = 0.06);
}

#[test]
fn priors_on_poses_are_weighed_in_the_tangent_space() {
    // Two priors on one pose, far from the start: the mean of nearby rotations, half the covariance.
    let truth = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.3, -2.5, 0.9));
    let step = [0.01, -0.02, 0.005, 0.002, 0.001, -0.003];
    let mut a = Adjustment::new();
    let pose = a.add_block(ParameterBlock::pose(&Isometry3::identity()));
    let covariance = Covariance::from_sigmas(&[0.1, 0.1, 0.1, 0.01, 0.01, 0.01]);
    for sign in [1.0, -1.0] {
        let mut values = [0.0; 7];
        RigidPose.plus(&RigidPose::values(&truth), &step.map(|s| sign * s), &mut values);
        a.add_prior(pose, &values, &covariance).unwrap();
    }
    let solution = solve(&a).unwrap();
    let found = solution.pose(pose).unwrap();
    // By symmetry the mean is the truth.
    assert!(found.rotation.angle_to(&truth.rotation) < 1e-9);
    assert_relative_eq!(found.translation.vector, truth.translation.vector, epsilon = 1e-12);
    let q = solution.covariance(pose, Scale::Prior).unwrap();
    assert_relative_eq!(q[(0, 0)], 0.005, epsilon = 1e-12);
    // The tangent at the mean differs from those at the priors by the square of 4 mrad.
    assert_relative_eq!(q[(3, 3)], 0.00005, max_relative = 1e-4);
    assert_eq!(solution.redundancy(), 6);
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let run = || {
        let mut n = network(&PLAN);
        let points = n.points.clone();
        n.adjustment.add_inner_constraints(&points, DatumDefect::Six).unwrap();
        let solution = solve(&n.adjustment).unwrap();
        (solution.covariance_matrix(Scale::Prior).unwrap(), solution.residuals().to_vec())
    };
    let first = run();
    assert_eq!(first, run());
    #[cfg(feature = "faer")]
    faer::set_global_parallelism(faer::Par::rayon(4));
    assert_eq!(first, run());
}
