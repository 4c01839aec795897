//! Variance components, significance, information criteria.

use adjust::{
    Adjustment, BlockId, ComponentPrecision, ComponentStatus, Covariance, Distribution, Error, GroupId,
    LinearObservation, ParameterBlock, RigidPose, Scale, SolveOptions, VarianceComponentOptions, VarianceFactor,
};
use approx::assert_relative_eq;
use nalgebra::{Isometry3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

fn normal(rng: &mut Pcg64) -> f64 {
    rng.sample(StandardNormal)
}

/// Three groups of different size observe six parameters; their true sigmas are the stated ones times `SHARE`.
const SHARE: [f64; 3] = [0.3, 1.0, 4.0];

fn three_groups(rng: &mut Pcg64) -> (Adjustment<'static>, Vec<GroupId>) {
    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean([0.0; 6]));
    let groups: Vec<_> = ["angles", "distances", "heights"].into_iter().map(|name| a.add_group(name)).collect();
    let stated = [0.01, 0.5, 2.0];
    // The designs are the same in each run: only the noise differs.
    let mut design = Pcg64::seed_from_u64(99);
    for (index, count) in [(0, 30), (1, 20), (2, 40)] {
        for _ in 0..count {
            let row: Vec<f64> = (0..6).map(|_| normal(&mut design)).collect();
            let noise = SHARE[index] * stated[index] * normal(rng);
            let observation = LinearObservation::new(row.iter().sum::<f64>() + noise, [(x, row)]);
            a.add_observation(groups[index], observation, &Covariance::from_sigma(stated[index])).unwrap();
        }
    }
    (a, groups)
}

#[test]
fn variance_components_are_unbiased_and_scatter_as_stated() {
    let runs = 400;
    let (mut sum, mut squares, mut stated) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    for seed in 0..runs {
        let (mut a, groups) = three_groups(&mut Pcg64::seed_from_u64(seed));
        let found = a
            .estimate_variance_components(&groups, &SolveOptions::default(), &VarianceComponentOptions::default())
            .unwrap();
        assert!(found.converged && found.precision == ComponentPrecision::Rigorous);
        // All groups are scaled: what is left is a variance factor of one, and each group's own is one.
        assert_relative_eq!(found.solution.sigma0().unwrap(), 1.0, epsilon = 1e-3);
        for (index, component) in found.components.iter().enumerate() {
            assert_eq!((component.status, component.group), (ComponentStatus::Estimated, groups[index]));
            let relative = component.factor / SHARE[index].powi(2);
            sum[index] += relative;
            squares[index] += relative * relative;
            stated[index] += (component.deviation / component.factor).powi(2);
        }
        assert_relative_eq!(found.components.iter().map(|c| c.redundancy).sum::<f64>(), 84.0, epsilon = 1e-6);
    }
    for index in 0..3 {
        let mean = sum[index] / runs as f64;
        let deviation = (squares[index] / runs as f64 - mean * mean).sqrt();
        let expected = (stated[index] / runs as f64).sqrt();
        // The mean scatters by deviation/√400: four times that. A standard deviation from 400 values is good to
        // 1/√800 = 3.5 %, somewhat more for the skew distribution of a variance: 15 %.
        assert_relative_eq!(mean, 1.0, epsilon = 4.0 * expected / (runs as f64).sqrt());
        assert_relative_eq!(deviation / expected, 1.0, epsilon = 0.15);
    }
}

#[test]
fn groups_without_redundancy_are_held_and_those_that_fit_exactly_are_named() {
    let mut rng = Pcg64::seed_from_u64(5);
    let (mut a, mut groups) = three_groups(&mut rng);
    let y = a.add_block(ParameterBlock::euclidean([0.0]));
    let single = a.add_group("single");
    a.add_observation(single, LinearObservation::new(3.0, [(y, [1.0])]), &Covariance::from_sigma(0.1)).unwrap();
    let exact = a.add_group("exact");
    for _ in 0..9 {
        a.add_observation(exact, LinearObservation::new(3.0, [(y, [1.0])]), &Covariance::from_sigma(0.1)).unwrap();
    }
    groups.push(single);
    let options = VarianceComponentOptions::default();
    let found = a.estimate_variance_components(&groups, &SolveOptions::default(), &options).unwrap();
    assert!(found.converged);
    assert_eq!((found.components[3].status, found.components[3].factor), (ComponentStatus::Held, 1.0));
    assert_eq!((found.components[3].name.as_str(), found.components[3].deviation), ("single", 0.0));
    let found = a.estimate_variance_components(&[exact], &SolveOptions::default(), &options).unwrap();
    assert!(!found.converged && found.components[0].status == ComponentStatus::OutOfRange);
    // Too few iterations are said.
    let (mut a, groups) = three_groups(&mut rng);
    let few = VarianceComponentOptions { max_iterations: 1, ..options.clone() };
    assert!(!a.estimate_variance_components(&groups, &SolveOptions::default(), &few).unwrap().converged);
    // Bad input, and nothing is scaled by it.
    let before = a.solve(&SolveOptions::default()).unwrap().vtpv();
    let bad = VarianceComponentOptions { tolerance: 0.0, ..options.clone() };
    assert!(a.estimate_variance_components(&groups, &SolveOptions::default(), &bad).is_err());
    let twice = [groups[0], groups[0]];
    assert!(a.estimate_variance_components(&twice, &SolveOptions::default(), &options).is_err());
    let failing = SolveOptions { max_iterations: 0, ..SolveOptions::default() };
    assert!(a.estimate_variance_components(&groups, &failing, &options).is_err());
    assert_eq!(a.solve(&SolveOptions::default()).unwrap().vtpv(), before);
}

/// Fifteen heights of a cubic whose two highest coefficients are zero. `sigma` is stated, 0.1 is true.
fn cubic(rng: &mut Pcg64, sigma: f64) -> (Adjustment<'static>, BlockId) {
    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean([0.0; 4]).named("cubic"));
    let group = a.add_group("heights");
    for i in 0..15 {
        let t = f64::from(i) / 7.0 - 1.0;
        let height = LinearObservation::new(1.0 + 2.0 * t + 0.1 * normal(rng), [(x, [1.0, t, t * t, t * t * t])]);
        a.add_observation(group, height, &Covariance::from_sigma(sigma)).unwrap();
    }
    (a, x)
}

/// Largest distance between the distribution of the values and the uniform one (Kolmogorov, Smirnov).
fn distance_to_uniform(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len() as f64;
    let step = |(index, value): (usize, &f64)| (value - index as f64 / n).abs().max((index as f64 + 1.0) / n - value);
    values.iter().enumerate().map(step).fold(0.0, f64::max)
}

#[test]
fn p_values_are_uniform_where_the_hypothesis_holds() {
    let runs = 1000;
    let mut values = vec![Vec::new(); 5];
    for seed in 0..runs {
        let mut rng = Pcg64::seed_from_u64(seed);
        let (a, x) = cubic(&mut rng, 0.1);
        let right = a.solve(&SolveOptions::default()).unwrap();
        values[0].push(right.significance(&[(x, 3)], Scale::Prior).unwrap().p_value);
        values[1].push(right.significance(&[(x, 3), (x, 2)], Scale::Prior).unwrap().p_value);
        // The posterior tests do not mind a wrong scale.
        let (a, x) = cubic(&mut rng, 0.7);
        let wrong = a.solve(&SolveOptions::default()).unwrap();
        values[2].push(wrong.significance(&[(x, 2)], Scale::Posterior).unwrap().p_value);
        values[3].push(wrong.significance(&[(x, 2), (x, 3)], Scale::Posterior).unwrap().p_value);
        let truth = [(x, 0, 1.0), (x, 1, 2.0), (x, 2, 0.0)];
        values[4].push(wrong.significance_against(&truth, Scale::Posterior).unwrap().p_value);
    }
    for (index, values) in values.into_iter().enumerate() {
        // 1.95/√n is exceeded with probability 0.001.
        let distance = distance_to_uniform(values);
        assert!(distance < 1.95 / (runs as f64).sqrt(), "{index}: {distance}");
    }
}

#[test]
fn tests_of_one_and_of_several_agree() {
    let (a, x) = cubic(&mut Pcg64::seed_from_u64(3), 0.1);
    let solution = a.solve(&SolveOptions::default()).unwrap();
    let slope = solution.significance(&[(x, 1)], Scale::Posterior).unwrap();
    assert_eq!(slope.distribution, Distribution::StudentT { dof: 11.0 });
    assert!(slope.p_value < 1e-6 && slope.statistic > 0.0);
    let sigma = solution.standard_deviations(x, Scale::Posterior).unwrap()[1];
    assert_relative_eq!(slope.statistic, solution.values(x).unwrap()[1] / sigma, max_relative = 1e-12);
    // F of all terms is by how much v'Pv grows without them.
    let both = solution.significance(&[(x, 2), (x, 3)], Scale::Posterior).unwrap();
    assert_eq!(both.distribution, Distribution::Fisher { numerator: 2.0, denominator: 11.0 });
    let mut less = cubic(&mut Pcg64::seed_from_u64(3), 0.1).0;
    for component in [2, 3] {
        less.hold_parameter(x, component).unwrap();
    }
    let held = less.solve(&SolveOptions::default()).unwrap();
    let growth = held.vtpv() - solution.vtpv();
    assert_relative_eq!(both.statistic, growth / 2.0 / solution.sigma0().unwrap().powi(2), max_relative = 1e-8);
    let prior = solution.significance(&[(x, 2), (x, 3)], Scale::Prior).unwrap();
    assert_relative_eq!(prior.statistic, growth, max_relative = 1e-8);
    // What cannot be tested is said.
    for parameters in [&[(x, 2)][..], &[], &[(x, 1), (x, 1)]] {
        assert!(matches!(held.significance(parameters, Scale::Prior), Err(Error::Untestable { .. })));
    }
    assert!(matches!(held.significance(&[(x, 4)], Scale::Prior), Err(Error::UnknownId { .. })));
    // Two parameters and a constraint between them: no test of both.
    less.release(x).unwrap();
    less.add_constraint(LinearObservation::new(0.5, [(x, [0.0, 0.0, 1.0, 1.0])])).unwrap();
    let tied = less.solve(&SolveOptions::default()).unwrap();
    assert!(tied.significance(&[(x, 2)], Scale::Prior).is_ok());
    assert!(matches!(tied.significance(&[(x, 2), (x, 3)], Scale::Prior), Err(Error::Untestable { .. })));
}

#[test]
fn a_change_of_a_pose_is_tested_in_its_tangent_space() {
    let truth = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.3, -2.5, 0.9));
    let sigmas = [0.01, 0.02, 0.01, 0.001, 0.002, 0.001];
    let mut values = Vec::new();
    for seed in 0..400 {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut a = Adjustment::new();
        let pose = a.add_block(ParameterBlock::pose(&truth));
        let mut observed = [0.0; 7];
        let step = sigmas.map(|sigma| sigma * normal(&mut rng));
        adjust::Manifold::plus(&RigidPose, &RigidPose::values(&truth), &step, &mut observed);
        a.add_prior(pose, &observed, &Covariance::from_sigmas(&sigmas)).unwrap();
        let solution = a.solve(&SolveOptions::default()).unwrap();
        let test = solution.significance_of_change(pose, &RigidPose::values(&truth), Scale::Prior).unwrap();
        assert_eq!(test.distribution, Distribution::ChiSquared { dof: 6.0 });
        values.push(test.p_value);
        assert!(solution.significance(&[(pose, 0)], Scale::Prior).is_err());
        assert!(solution.significance_of_change(pose, &[0.0; 7], Scale::Prior).is_err());
    }
    assert!(distance_to_uniform(values) < 1.95 / 20.0);
}

#[test]
fn schwarz_finds_the_order_of_a_polynomial() {
    let runs = 100;
    let (mut right, mut right_unknown, mut too_large) = (0, 0, 0);
    for seed in 0..runs {
        let order = |sigma: f64, factor: VarianceFactor, bic: bool| {
            let criterion = |terms: usize| {
                let mut rng = Pcg64::seed_from_u64(seed);
                let mut a = Adjustment::new();
                let x = a.add_block(ParameterBlock::euclidean(vec![0.0; terms]));
                let group = a.add_group("heights");
                for i in 0..80 {
                    let t = f64::from(i) / 39.5 - 1.0;
                    let row: Vec<f64> = (0..terms).map(|power| t.powi(power as i32)).collect();
                    let truth = 1.0 - 0.5 * t + 0.4 * t * t;
                    let height = LinearObservation::new(truth + 0.1 * normal(&mut rng), [(x, row)]);
                    a.add_observation(group, height, &Covariance::from_sigma(sigma)).unwrap();
                }
                let criteria = a.solve(&SolveOptions::default()).unwrap().information_criteria(factor).unwrap();
                assert!(criteria.aicc > criteria.aic && criteria.observations == 80);
                if bic { criteria.bic } else { criteria.aic }
            };
            (1..7).min_by(|&a, &b| criterion(a).total_cmp(&criterion(b))).unwrap()
        };
        right += usize::from(order(0.1, VarianceFactor::Known, true) == 3);
        right_unknown += usize::from(order(3.0, VarianceFactor::Unknown, true) == 3);
        too_large += usize::from(order(0.1, VarianceFactor::Known, false) > 3);
    }
    // A superfluous term passes BIC with P(χ²₁ > ln 80) = 3.6 %, several together somewhat more often; AIC with
    // P(χ²₁ > 2) = 16 % and more.
    assert!(right >= 88 && right_unknown >= 88 && too_large >= 10, "{right} {right_unknown} {too_large}");
}

#[test]
fn criteria_count_what_is_estimated() {
    let (mut a, x) = cubic(&mut Pcg64::seed_from_u64(1), 0.1);
    let of = |a: &Adjustment<'_>, factor| a.solve(&SolveOptions::default()).unwrap().information_criteria(factor);
    let known = of(&a, VarianceFactor::Known).unwrap();
    let vtpv = a.solve(&SolveOptions::default()).unwrap().vtpv();
    assert_eq!((known.parameters, known.observations), (4, 15));
    assert_relative_eq!(known.aic, vtpv + 8.0, max_relative = 1e-12);
    assert_relative_eq!(known.aicc, vtpv + 8.0 + 40.0 / 10.0, max_relative = 1e-12);
    assert_relative_eq!(known.bic, vtpv + 4.0 * 15.0_f64.ln(), max_relative = 1e-12);
    let unknown = of(&a, VarianceFactor::Unknown).unwrap();
    assert_relative_eq!(unknown.aic, 15.0 * (vtpv / 15.0).ln() + 10.0, max_relative = 1e-12);
    a.hold_parameter(x, 3).unwrap();
    a.add_constraint(LinearObservation::new(0.0, [(x, [0.0, 0.0, 1.0, 0.0])])).unwrap();
    assert_eq!(of(&a, VarianceFactor::Known).unwrap().parameters, 2);
    // No redundancy: nothing is known of the variance, and the correction has no value.
    let mut two = Adjustment::new();
    let x = two.add_block(ParameterBlock::euclidean([0.0]));
    let group = two.add_group("one");
    two.add_observation(group, LinearObservation::new(1.0, [(x, [1.0])]), &Covariance::from_sigma(1.0)).unwrap();
    assert!(matches!(of(&two, VarianceFactor::Unknown), Err(Error::NoRedundancy { .. })));
    assert_eq!(of(&two, VarianceFactor::Known).unwrap().aicc, f64::INFINITY);
}
