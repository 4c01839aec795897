//! Gross errors: test, rejection, taking back, reliability.

use crate::common::{Plan, network, network_with_gross_errors};
use adjust::{
    Adjustment, BlockId, Covariance, DatumDefect, Distribution, Error, FunctionObservation, GroupId, LinearObservation,
    ObservationId, ParameterBlock, ReliabilityOptions, Scale, SnoopingEnd, SnoopingOptions, SnoopingTest, SolveOptions,
};
use approx::assert_relative_eq;
use nalgebra::{Matrix2, Matrix2x3, Vector2};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

fn normal(rng: &mut Pcg64) -> f64 {
    rng.sample(StandardNormal)
}

/// Two heights and their difference at a time, correlated within an observation, of a parabola in t.
struct Pairs {
    adjustment: Adjustment<'static>,
    curve: BlockId,
    group: GroupId,
    observations: Vec<ObservationId>,
}

fn covariance() -> Matrix2<f64> {
    Matrix2::new(0.04, 0.05, 0.05, 0.09)
}

/// `errors` are (observation, component, gross error).
fn pairs(count: usize, rng: &mut Pcg64, errors: &[(usize, usize, f64)]) -> Pairs {
    let mut adjustment = Adjustment::new();
    let curve = adjustment.add_block(ParameterBlock::euclidean([0.0; 3]).named("curve"));
    let group = adjustment.add_group("pairs");
    let root = covariance().cholesky().unwrap().l();
    let mut observations = Vec::new();
    for i in 0..count {
        let t = i as f64 / count as f64;
        let design = Matrix2x3::new(1.0, t, t * t, 0.3, -t, 2.0 * t * t * t);
        let mut observed =
            root * Vector2::new(normal(rng), normal(rng)) + design * nalgebra::Vector3::new(1.0, 2.0, 3.0);
        for &(_, component, error) in errors.iter().filter(|(at, _, _)| *at == i) {
            observed[component] += error;
        }
        let observation = FunctionObservation::new([curve], 2, move |parameters, residual, jacobians| {
            let model = design * nalgebra::Vector3::from_column_slice(parameters[0]);
            residual.copy_from_slice((observed - model).as_slice());
            if let Some(jacobians) = jacobians {
                jacobians.set(0, &design);
            }
            Ok(())
        });
        let id = adjustment.add_observation(group, observation, &Covariance::from_matrix(&covariance())).unwrap();
        observations.push(id);
    }
    Pairs { adjustment, curve, group, observations }
}

fn solve(a: &Adjustment<'_>) -> adjust::Solution {
    a.solve(&SolveOptions::default()).unwrap()
}

#[test]
fn the_statistic_is_that_of_an_added_parameter() {
    // w² is by how much v'Pv falls when the component gets an error of its own as an unknown, that is, when it is
    // excluded: with correlations inside the observation too.
    let mut rng = Pcg64::seed_from_u64(1);
    let mut p = pairs(12, &mut rng, &[(4, 1, 1.0)]);
    let solution = solve(&p.adjustment);
    let test = solution.snoop(SnoopingTest::Baarda, 0.001).unwrap();
    let tau = solution.snoop(SnoopingTest::Pope, 0.001).unwrap();
    for &observation in &p.observations {
        for component in 0..2 {
            let row = solution.rows(observation).unwrap().start + component;
            p.adjustment.exclude(observation, component).unwrap();
            assert!(p.adjustment.is_excluded(observation, component).unwrap());
            let without = solve(&p.adjustment);
            assert_eq!(without.redundancy(), solution.redundancy() - 1);
            assert_relative_eq!(test.statistics[row].powi(2), solution.vtpv() - without.vtpv(), max_relative = 1e-9);
            assert_relative_eq!(without.redundancy_numbers().iter().sum::<f64>(), 20.0, epsilon = 1e-10);
            assert_eq!(without.redundancy_numbers()[row], 0.0);
            p.adjustment.readmit(observation, component).unwrap();
            let sigma0 = solution.sigma0().unwrap();
            assert_relative_eq!(tau.statistics[row] * sigma0, test.statistics[row], max_relative = 1e-12);
        }
    }
    // All as before, bit for bit.
    assert_eq!(solve(&p.adjustment).residuals(), solution.residuals());
    assert_relative_eq!(test.critical, 3.2905, epsilon = 1e-4);
}

#[test]
fn excluding_all_components_is_leaving_the_observation_out() {
    let mut rng = Pcg64::seed_from_u64(2);
    let mut all = pairs(8, &mut rng, &[]);
    for component in 0..2 {
        all.adjustment.exclude(all.observations[7], component).unwrap();
    }
    let solution = solve(&all.adjustment);
    let mut fewer = Adjustment::new();
    let curve = fewer.add_block(ParameterBlock::euclidean([0.0; 3]));
    let group = fewer.add_group("pairs");
    let mut rng = Pcg64::seed_from_u64(2);
    let root = covariance().cholesky().unwrap().l();
    for i in 0..7 {
        let t = f64::from(i) / 8.0;
        let design = Matrix2x3::new(1.0, t, t * t, 0.3, -t, 2.0 * t * t * t);
        let noise = root * Vector2::new(normal(&mut rng), normal(&mut rng));
        let observed = noise + design * nalgebra::Vector3::new(1.0, 2.0, 3.0);
        let observation = FunctionObservation::new([curve], 2, move |parameters, residual, jacobians| {
            let model = design * nalgebra::Vector3::from_column_slice(parameters[0]);
            residual.copy_from_slice((observed - model).as_slice());
            if let Some(jacobians) = jacobians {
                jacobians.set(0, &design);
            }
            Ok(())
        });
        fewer.add_observation(group, observation, &Covariance::from_matrix(&covariance())).unwrap();
    }
    let other = solve(&fewer);
    for (a, b) in solution.values(all.curve).unwrap().iter().zip(other.values(curve).unwrap()) {
        assert_relative_eq!(*a, *b, max_relative = 1e-10);
    }
    assert_eq!(solution.redundancy(), other.redundancy());
    let (a, b) = (solution.covariance(all.curve, Scale::Posterior), other.covariance(curve, Scale::Posterior));
    assert_relative_eq!(a.unwrap(), b.unwrap(), max_relative = 1e-9);
    assert_eq!(solution.group(all.group).unwrap().observations, 14);
    // The residual of what is left out is that of a prediction.
    let sigma = solution.residual_deviations(Scale::Prior).unwrap();
    assert!(sigma[14] > 0.2 && sigma[15] > 0.3);
}

#[test]
fn components_are_rejected_one_by_one() {
    for test in [SnoopingTest::Baarda, SnoopingTest::Pope] {
        for batch in [1, 64] {
            let mut rng = Pcg64::seed_from_u64(3);
            let errors = [(5, 0, 4.0), (20, 1, -6.0), (21, 1, 5.0)];
            let mut p = pairs(40, &mut rng, &errors);
            let options = SnoopingOptions { test, batch, ..SnoopingOptions::default() };
            let found = p.adjustment.solve_snooping(&SolveOptions::default(), &options).unwrap();
            let mut rejected: Vec<_> = found.rejected.iter().map(|r| (r.observation.index(), r.component)).collect();
            rejected.sort_unstable();
            assert_eq!(rejected, [(5, 0), (20, 1), (21, 1)], "{test:?} {batch}");
            assert_eq!(found.end, SnoopingEnd::Clean);
            for r in &found.rejected {
                assert!(r.statistic.abs() > r.critical && r.redundancy_number > 0.01);
                let partner = found.solution.rows(r.observation).unwrap().start + 1 - r.component;
                assert!(!found.solution.is_excluded(partner));
            }
            // One solution for the three, one before, where batches are allowed.
            assert_eq!(found.solutions, if batch == 1 { 4 } else { 2 });
            for (value, truth) in found.solution.values(p.curve).unwrap().iter().zip([1.0, 2.0, 3.0]) {
                assert_relative_eq!(*value, truth, epsilon = 0.6);
            }
        }
    }
}

#[test]
fn false_alarms_have_the_stated_probability_and_small_errors_the_stated_power() {
    // At level 5 % one test of a good observation in 20 fails, at any redundancy number, whatever the correlation; an
    // error of the size ∇₀ is found in 80 %.
    let reliability = ReliabilityOptions { level: 0.05, power: 0.80 };
    let (mut alarms, mut found, mut tau_alarms) = (0, 0, 0);
    let runs = 2000;
    for seed in 0..runs {
        let mut rng = Pcg64::seed_from_u64(1000 + seed);
        let p = pairs(5, &mut rng, &[]);
        let solution = solve(&p.adjustment);
        let size = solution.reliability(&reliability).unwrap()[5].smallest_detectable;
        let statistic = |test, solution: &adjust::Solution| {
            let test = solution.snoop(test, 0.05).unwrap();
            usize::from(test.statistics[5].abs() > test.critical)
        };
        alarms += statistic(SnoopingTest::Baarda, &solution);
        tau_alarms += statistic(SnoopingTest::Pope, &solution);
        let mut rng = Pcg64::seed_from_u64(1000 + seed);
        let wrong = pairs(5, &mut rng, &[(2, 1, size)]);
        found += statistic(SnoopingTest::Baarda, &solve(&wrong.adjustment));
    }
    let share = |count: usize| count as f64 / runs as f64;
    // Four standard deviations of a share: 4 √(p (1 − p) / 2000).
    assert_relative_eq!(share(alarms), 0.05, epsilon = 0.02);
    assert_relative_eq!(share(tau_alarms), 0.05, epsilon = 0.02);
    assert_relative_eq!(share(found), 0.80, epsilon = 0.036);
}

#[test]
fn a_smallest_detectable_error_moves_the_parameters_as_stated() {
    let options = ReliabilityOptions::default();
    assert_relative_eq!(options.noncentrality().unwrap(), 4.13, epsilon = 0.005);
    let build = |errors: &[(usize, usize, f64)]| pairs(9, &mut Pcg64::seed_from_u64(9), errors);
    let clean = build(&[]);
    let solution = solve(&clean.adjustment);
    let internal = solution.reliability(&options).unwrap();
    for (observation, component) in [(0, 0), (4, 1), (8, 0)] {
        let id = clean.observations[observation];
        let external = solution.external_reliability(id, component, &[clean.curve], &options).unwrap();
        let row = solution.rows(id).unwrap().start + component;
        assert_eq!(external.internal, internal[row]);
        let moved = solve(&build(&[(observation, component, internal[row].smallest_detectable)]).adjustment);
        let before = solution.values(clean.curve).unwrap();
        let difference: Vec<f64> =
            moved.values(clean.curve).unwrap().iter().zip(before).map(|(after, before)| after - before).collect();
        for (found, expected) in difference.iter().zip(&external.effects[0].1) {
            assert_relative_eq!(*found, *expected, epsilon = 1e-9);
        }
        // δ̄² = ∇xᵀ N ∇x, and no parameter moves more in its own standard deviation.
        let effect = nalgebra::DVector::from_vec(difference);
        let q = solution.covariance(clean.curve, Scale::Prior).unwrap();
        let square = (effect.transpose() * q.try_inverse().unwrap() * &effect)[0];
        assert_relative_eq!(square.sqrt(), internal[row].bar_delta, max_relative = 1e-7);
        assert!(external.largest_ratio <= internal[row].bar_delta * (1.0 + 1e-9) && external.largest_ratio > 0.0);
    }
}

#[test]
fn what_nothing_controls_is_never_rejected() {
    // Four observations of a mean, one of them wrong, and one that alone determines a second parameter.
    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean([0.0]));
    let y = a.add_block(ParameterBlock::euclidean([0.0]));
    let group = a.add_group("heights");
    for value in [0.0, 0.1, -0.1, 9.0] {
        a.add_observation(group, LinearObservation::new(value, [(x, [1.0])]), &Covariance::from_sigma(0.1)).unwrap();
    }
    a.add_observation(group, LinearObservation::new(5e9, [(y, [1.0])]), &Covariance::from_sigma(1e-3)).unwrap();
    let test = solve(&a).snoop(SnoopingTest::Baarda, 0.001).unwrap();
    assert!(test.statistics[4].is_nan() && test.suspects.iter().all(|s| s.observation.index() != 4));
    let internal = solve(&a).reliability(&ReliabilityOptions::default()).unwrap()[4];
    assert_eq!((internal.control, internal.smallest_detectable), (0.0, f64::INFINITY));
    let options = SnoopingOptions { max_rejections: Some(5), ..SnoopingOptions::default() };
    let found = a.solve_snooping(&SolveOptions::default(), &options).unwrap();
    assert_eq!(found.rejected.len(), 1);
    assert_eq!(found.rejected[0].observation.index(), 3);
    assert_relative_eq!(found.solution.values(x).unwrap()[0], 0.0, epsilon = 1e-9);
    // Two that contradict each other: neither can be told from the other once one is gone, so only one goes.
    let mut two = Adjustment::new();
    let x = two.add_block(ParameterBlock::euclidean([0.0]));
    let group = two.add_group("heights");
    for value in [0.0, 9.0] {
        two.add_observation(group, LinearObservation::new(value, [(x, [1.0])]), &Covariance::from_sigma(0.1)).unwrap();
    }
    let found = two.solve_snooping(&SolveOptions::default(), &options).unwrap();
    assert_eq!((found.rejected.len(), found.solution.redundancy()), (1, 0));
    // And the posterior test has nothing to go by.
    assert!(found.solution.snoop(SnoopingTest::Pope, 0.001).unwrap().critical.is_nan());
}

#[test]
fn limits_and_options_are_kept() {
    let mut rng = Pcg64::seed_from_u64(4);
    let mut p = pairs(30, &mut rng, &[(3, 0, 9.0), (11, 0, 8.0), (17, 1, 7.0)]);
    let solve_options = SolveOptions::default();
    let options = SnoopingOptions { max_rejections: Some(2), ..SnoopingOptions::default() };
    let found = p.adjustment.solve_snooping(&solve_options, &options).unwrap();
    assert_eq!((found.rejected.len(), found.end), (2, SnoopingEnd::LimitReached));
    // Once more: what is excluded stays, the third is found.
    let found = p.adjustment.solve_snooping(&solve_options, &SnoopingOptions::default()).unwrap();
    assert_eq!((found.rejected.len(), found.end), (1, SnoopingEnd::Clean));
    for bad in [
        SnoopingOptions { level: 0.0, ..SnoopingOptions::default() },
        SnoopingOptions { level: f64::NAN, ..SnoopingOptions::default() },
        SnoopingOptions { batch: 0, ..SnoopingOptions::default() },
        SnoopingOptions { smallest_control: -1.0, ..SnoopingOptions::default() },
    ] {
        assert!(matches!(p.adjustment.solve_snooping(&solve_options, &bad), Err(Error::Option { .. })));
    }
    assert!(p.adjustment.exclude(p.observations[0], 2).is_err());
    assert!(p.adjustment.scale_covariance(p.group, 0.0).is_err());
    assert!(p.adjustment.scale_covariance(p.group, f64::NAN).is_err());
    let none = SnoopingOptions { groups: Some(vec![]), ..SnoopingOptions::default() };
    let mut rng = Pcg64::seed_from_u64(4);
    let mut p = pairs(30, &mut rng, &[(3, 0, 9.0)]);
    assert!(p.adjustment.solve_snooping(&solve_options, &none).unwrap().rejected.is_empty());
}

#[test]
fn questions_without_an_answer_are_refused() {
    let p = pairs(5, &mut Pcg64::seed_from_u64(1), &[]);
    let solution = solve(&p.adjustment);
    for level in [0.0, 1.0, -0.5, f64::NAN] {
        assert!(matches!(solution.snoop(SnoopingTest::Pope, level), Err(Error::Option { name: "level", .. })));
        let options = ReliabilityOptions { power: level, ..ReliabilityOptions::default() };
        assert!(matches!(solution.reliability(&options), Err(Error::Option { name: "power", .. })));
    }
    let options = ReliabilityOptions::default();
    let id = p.observations[0];
    let foreign = pairs(9, &mut Pcg64::seed_from_u64(1), &[]).observations[8];
    assert!(matches!(solution.external_reliability(id, 2, &[p.curve], &options), Err(Error::UnknownId { .. })));
    assert!(matches!(solution.external_reliability(foreign, 0, &[p.curve], &options), Err(Error::UnknownId { .. })));
    assert!(p.adjustment.is_excluded(foreign, 0).is_err());
    // All held: residuals without unknowns are tests of the values themselves.
    let mut held = pairs(5, &mut Pcg64::seed_from_u64(1), &[]);
    held.adjustment.hold(held.curve).unwrap();
    let solution = solve(&held.adjustment);
    let reliability = solution.reliability(&options).unwrap()[0];
    assert_relative_eq!(reliability.control, 1.0, epsilon = 1e-12);
    assert_eq!(reliability.bar_delta, 0.0);
    assert_eq!(solution.external_reliability(id, 0, &[held.curve], &options).unwrap().effects[0].1, [0.0; 3]);
    assert!(held.adjustment.solve_snooping(&SolveOptions::default(), &SnoopingOptions::default()).is_ok());
}

#[test]
fn what_larger_errors_pulled_off_is_taken_back() {
    // Cubics with two or three gross errors among 14 heights: at a level of 5 % good heights fail too, some only because of them.
    let mut taken_back = 0;
    for seed in 0..300 {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut a = Adjustment::new();
        let cubic = a.add_block(ParameterBlock::euclidean([0.0; 4]));
        let group = a.add_group("heights");
        let wrong: Vec<usize> = (0..rng.random_range(2..4)).map(|_| rng.random_range(0..14)).collect();
        for i in 0..14 {
            let error = if wrong.contains(&i) { 0.6 + 2.0 * rng.random::<f64>() } else { 0.0 };
            let t = (i as f64 - 6.5) / 6.5;
            let height = LinearObservation::new(0.1 * normal(&mut rng) + error, [(cubic, [1.0, t, t * t, t * t * t])]);
            a.add_observation(group, height, &Covariance::from_sigma(0.1)).unwrap();
        }
        let test = if seed % 2 == 0 { SnoopingTest::Baarda } else { SnoopingTest::Pope };
        let options =
            SnoopingOptions { test, level: 0.05, max_rejections: Some(8), batch: 1, ..SnoopingOptions::default() };
        let found = a.solve_snooping(&SolveOptions::default(), &options).unwrap();
        taken_back += found.readmitted.len();
        assert!(found.readmitted.iter().all(|r| r.statistic.abs() <= r.critical));
        // Consistent in the end: what is in fits; what is out does not, unless it was tried twice.
        let test = found.solution.snoop(test, 0.05).unwrap();
        assert!(test.suspects.is_empty() || found.end == SnoopingEnd::LimitReached);
        let predicted = found.solution.snoop(SnoopingTest::Baarda, 0.05).unwrap();
        let sigma0 = if options.test == SnoopingTest::Pope { found.solution.sigma0().unwrap() } else { 1.0 };
        for r in &found.rejected {
            let tried = found.readmitted.iter().any(|other| other.observation == r.observation);
            // Prior-scaled it is normal, posterior-scaled Student's t with its longer tail.
            let w = predicted.statistics[found.solution.rows(r.observation).unwrap().start] / sigma0;
            assert!(tried || w.abs() > predicted.critical, "{seed}: {r:?} {w}");
        }
    }
    assert!(taken_back >= 3, "{taken_back}");
}

/// A network as in the laboratory: 24 stations, 103 points, some 3,000 values, one in a hundred grossly wrong.
#[test]
fn one_percent_of_a_network_is_found() {
    let plan = Plan { seed: 12, stations: 24, points: 103, seen: 43, ranges: true, disturbance: 0.0 };
    let (mut network, wrong) = network_with_gross_errors(&plan, 77);
    let found = network.adjustment.solve_snooping(&SolveOptions::default(), &SnoopingOptions::default()).unwrap();
    let rejected: std::collections::BTreeSet<_> =
        found.rejected.iter().map(|r| (r.observation.index(), r.component)).collect();
    assert_eq!(wrong.len(), 32);
    assert!(wrong.iter().all(|one| rejected.contains(one)), "{rejected:?}");
    // At a level of 0.001 some three of 3,064 good values fail; the largest plausible number is ten.
    assert!(rejected.len() <= wrong.len() + 10, "{}", rejected.len());
    assert!(found.solutions <= 4, "{}", found.solutions);
    // One at a time rejects the same.
    let (mut network, _) = network_with_gross_errors(&plan, 77);
    let single = SnoopingOptions { batch: 1, ..SnoopingOptions::default() };
    let slowly = network.adjustment.solve_snooping(&SolveOptions::default(), &single).unwrap();
    assert_eq!(rejected, slowly.rejected.iter().map(|r| (r.observation.index(), r.component)).collect());
    assert_eq!(slowly.solutions, rejected.len() + 1);
    let expected = Distribution::ChiSquared { dof: found.solution.redundancy() as f64 };
    // The rejected tails make v'Pv a little small; a remaining gross error would make it large.
    assert!(expected.survival(found.solution.vtpv()) > 0.001);
}

#[test]
fn excluded_ranges_are_as_if_they_had_not_been_measured_in_a_large_network() {
    // Large enough for the points to be eliminated from the normal equations.
    let plan = Plan { seed: 5, stations: 20, points: 90, seen: 60, ranges: true, disturbance: 0.0 };
    let mut with = network(&plan);
    let mut without = network(&Plan { ranges: false, ..plan });
    let points = with.points.clone();
    with.adjustment.add_inner_constraints(&points, DatumDefect::Six).unwrap();
    without.adjustment.add_inner_constraints(&points, DatumDefect::Seven).unwrap();
    // All ranges out but one, that of the first sight, which then gives the scale and is not controlled.
    for &observation in &with.observations[1..] {
        with.adjustment.exclude(observation, 2).unwrap();
    }
    let (with, without) = (solve(&with.adjustment), solve(&without.adjustment));
    assert_eq!(with.redundancy(), without.redundancy());
    assert_relative_eq!(with.vtpv(), without.vtpv(), max_relative = 1e-9);
    let (used, numbers) = (with.redundancy_numbers(), without.redundancy_numbers());
    for (index, pair) in numbers.chunks(2).enumerate() {
        assert_relative_eq!(used[3 * index..3 * index + 2], *pair, epsilon = 1e-6);
    }
    assert_relative_eq!(used[2], 0.0, epsilon = 1e-6);
    assert!(with.snoop(SnoopingTest::Baarda, 0.001).unwrap().statistics[2].is_nan());
}
