//! Covariances in another datum, without solving again.

use crate::common::{Network, Plan, network};
use adjust::{
    BlockId, Covariance, DatumDefect, Error, FunctionObservation, LinearObservation, Moving, ParameterBlock, Scale,
    Solution, SolveOptions,
};
use approx::assert_relative_eq;
use nalgebra::Vector3;

const PLAN: Plan = Plan { seed: 7, stations: 4, points: 9, seen: 9, ranges: true, disturbance: 0.02 };

/// The network, and a block of an additional parameter that does not move: with ranges, the offset of an instrument that
/// measures distances between the points; without, one of its own.
fn with_parameters(ranges: bool) -> (Network, BlockId) {
    let mut n = network(&Plan { ranges, ..PLAN });
    let extra = n.adjustment.add_block(ParameterBlock::euclidean([0.0]).named("extra"));
    let group = n.adjustment.add_group("extra");
    let observation = LinearObservation::new(0.3, [(extra, [1.0])]);
    n.adjustment.add_observation(group, observation, &Covariance::from_sigma(0.1)).unwrap();
    for pair in n.points.windows(2).zip(n.true_points.windows(2)).take(if ranges { 8 } else { 0 }) {
        let (&[from, to], &[start, end]) = pair else { panic!() };
        let observed = (end - start).norm() + 0.31;
        let distance = FunctionObservation::new([from, to, extra], 1, move |parameters, residual, jacobians| {
            let between = Vector3::from_column_slice(parameters[1]) - Vector3::from_column_slice(parameters[0]);
            residual[0] = observed - between.norm() - parameters[2][0];
            if let Some(jacobians) = jacobians {
                let direction = between.transpose() / between.norm();
                jacobians.set(0, &-direction);
                jacobians.set(1, &direction);
                jacobians.set(2, &nalgebra::Matrix1::new(1.0));
            }
            Ok(())
        });
        n.adjustment.add_observation(group, distance, &Covariance::from_sigma(0.002)).unwrap();
    }
    (n, extra)
}

fn moving(n: &Network) -> Vec<Moving> {
    let points = n.points.iter().map(|&point| Moving::Point(point));
    points.chain(n.stations.iter().map(|&station| Moving::Pose(station))).collect()
}

fn solve_on(n: &mut Network, datum: &[BlockId], defect: DatumDefect) -> Solution {
    n.adjustment.add_inner_constraints(datum, defect).unwrap();
    n.adjustment.solve(&SolveOptions::default()).unwrap()
}

#[test]
fn another_datum_agrees_with_another_solution() {
    for (ranges, defect) in [(true, DatumDefect::Six), (false, DatumDefect::Seven)] {
        let (mut n, extra) = with_parameters(ranges);
        let (first, second) = (n.points[..4].to_vec(), n.points[3..].to_vec());
        let start = solve_on(&mut n, &first, defect);
        n.adjustment.start_from(&start).unwrap();
        let direct = solve_on(&mut n, &second, defect);
        // Both at the same place: the second is solved from the first.
        let transformed = start.transformed_to(&second, &moving(&n), defect).unwrap();
        let blocks: Vec<_> = n.points.iter().chain(&n.stations).copied().chain([extra]).collect();
        for (index, &a) in blocks.iter().enumerate() {
            for &b in &blocks[..=index] {
                let found = transformed.covariance_between(a, b, Scale::Prior).unwrap();
                let expected = direct.covariance_between(a, b, Scale::Prior).unwrap();
                // Variances are some 1e-6; the two are linearised 1e-8 standard deviations apart.
                assert_relative_eq!(found, expected, epsilon = 1e-12);
            }
            let sigma = transformed.standard_deviations(a, Scale::Posterior).unwrap();
            for (found, expected) in sigma.iter().zip(direct.standard_deviations(a, Scale::Posterior).unwrap()) {
                assert_relative_eq!(*found, expected, max_relative = 1e-6);
            }
        }
        // There and back.
        let same = start.transformed_to(&first, &moving(&n), defect).unwrap();
        let point = n.points[7];
        assert_relative_eq!(
            same.covariance(point, Scale::Prior).unwrap(),
            start.covariance(point, Scale::Prior).unwrap(),
            epsilon = 1e-14
        );
    }
}

#[test]
fn a_held_station_is_released_by_the_transformation() {
    let mut held = network(&PLAN);
    held.adjustment.hold(held.stations[0]).unwrap();
    let start = held.adjustment.solve(&SolveOptions::default()).unwrap();
    let mut free = network(&PLAN);
    for (&block, &same) in free.points.iter().chain(&free.stations).zip(held.points.iter().chain(&held.stations)) {
        free.adjustment.set_values(block, start.values(same).unwrap()).unwrap();
    }
    let points = free.points.clone();
    let direct = solve_on(&mut free, &points, DatumDefect::Six);
    let transformed = start.transformed_to(&held.points, &moving(&held), DatumDefect::Six).unwrap();
    for (&a, &b) in held.points.iter().chain(&held.stations).zip(free.points.iter().chain(&free.stations)) {
        let found = transformed.covariance(a, Scale::Prior).unwrap();
        assert_relative_eq!(found, direct.covariance(b, Scale::Prior).unwrap(), epsilon = 1e-12);
    }
}

#[test]
fn what_would_be_wrong_is_refused() {
    let (mut n, extra) = with_parameters(true);
    let points = n.points.clone();
    let solution = solve_on(&mut n, &points, DatumDefect::Six);
    let all = moving(&n);
    let refused = |datum: &[BlockId], moving: &[Moving], defect| match solution.transformed_to(datum, moving, defect) {
        Err(Error::Datum { reason }) => reason,
        other => panic!("{other:?}"),
    };
    // A station forgotten, a wrong kind, too few points, a scale that ranges have fixed.
    assert!(refused(&points, &all[..all.len() - 1], DatumDefect::Six).contains("not named"));
    assert!(refused(&points, &[Moving::Pose(extra)], DatumDefect::Six).contains("not a rigid pose"));
    assert!(refused(&points, &[Moving::Point(extra)], DatumDefect::Six).contains("three coordinates"));
    assert!(refused(&points[..2], &all, DatumDefect::Six).contains("2 points"));
    assert!(refused(&points, &all, DatumDefect::Seven).contains("sights"));
    let twice = [points[0], points[1], points[0]];
    assert!(matches!(solution.transformed_to(&twice, &all, DatumDefect::Six), Err(Error::Untestable { .. })));
    // A control point carries the datum already.
    let mut control = network(&PLAN);
    for &point in &control.points[..3] {
        let values = control.adjustment.values(point).unwrap().to_vec();
        control.adjustment.add_prior(point, &values, &Covariance::from_sigmas(&[0.01; 3])).unwrap();
    }
    let solution = control.adjustment.solve(&SolveOptions::default()).unwrap();
    let refused = solution.transformed_to(&control.points, &moving(&control), DatumDefect::Six);
    assert!(matches!(refused, Err(Error::Datum { .. })));
}
