//! The global test: its limits against tables, its rate on sound problems, and what it finds.

use adjust::{
    Adjustment, Covariance, Error, GlobalTest, GlobalVerdict, Kernel, LinearObservation, ParameterBlock, Solution,
    SolveOptions,
};
use approx::assert_relative_eq;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

/// Names and numbers of values of three groups on five parameters. The second carries most parameters.
const GROUPS: [(&str, usize); 3] = [("many", 25), ("few", 4), ("pairs", 6)];

fn solve(seed: u64, share: [f64; 3], kernel: Kernel) -> Solution {
    let (mut design, mut noise) = (Pcg64::seed_from_u64(7), Pcg64::seed_from_u64(seed));
    let mut a = Adjustment::new();
    let x = a.add_block(ParameterBlock::euclidean([0.0; 5]));
    for ((name, count), share) in GROUPS.into_iter().zip(share) {
        let group = a.add_group(name);
        a.set_kernel(group, kernel).unwrap();
        for _ in 0..count {
            let row: Vec<f64> = (0..5).map(|_| design.sample(StandardNormal)).collect();
            let error: f64 = noise.sample(StandardNormal);
            let sigma = if name == "few" { 0.1 } else { 1.0 };
            let observation = LinearObservation::new(share * sigma * error, [(x, row)]);
            a.add_observation(group, observation, &Covariance::from_sigma(sigma)).unwrap();
        }
    }
    a.solve(&SolveOptions::default()).unwrap()
}

#[test]
fn limits_are_those_of_tables() {
    // Degrees of freedom, level, quantiles of χ² with half of it on each side (Abramowitz and Stegun, table 26.8).
    for (dof, level, low, high) in [
        (1.0, 0.10, 0.003_932_14, 3.841_46),
        (5.0, 0.05, 0.831_211, 12.8325),
        (10.0, 0.01, 2.155_85, 25.1882),
        (30.0, 0.05, 16.7908, 46.9792),
        (100.0, 0.10, 77.9294, 124.342),
    ] {
        let test = GlobalTest::new("table", dof, dof, level).unwrap();
        assert_relative_eq!(test.limits.0, low, max_relative = 5e-6);
        assert_relative_eq!(test.limits.1, high, max_relative = 5e-6);
        assert_eq!((test.verdict, test.sigma0()), (GlobalVerdict::AsStated, 1.0));
        // The verdict turns where the p-value crosses the level.
        for (limit, verdict) in [(test.limits.0, GlobalVerdict::TooSmall), (test.limits.1, GlobalVerdict::TooLarge)] {
            let at = |statistic| GlobalTest::new("table", statistic, dof, level).unwrap();
            assert_relative_eq!(at(limit).p_value, level, max_relative = 1e-9);
            let outwards = if verdict == GlobalVerdict::TooLarge { 1.001 } else { 0.999 };
            assert_eq!(at(limit * outwards).verdict, verdict);
            assert_eq!(at(limit / outwards).verdict, GlobalVerdict::AsStated);
        }
    }
}

#[test]
fn sound_adjustments_fail_at_the_stated_rate() {
    const RUNS: u64 = 2000;
    for level in [0.05, 0.01] {
        let mut failed = [0_u32; 4];
        for seed in 0..RUNS {
            let solution = solve(seed, [1.0; 3], Kernel::default());
            let tests = solution.group_tests(level).unwrap();
            let all = solution.global_test(level).unwrap();
            for (count, test) in failed.iter_mut().zip(tests.iter().chain([&all])) {
                *count += u32::from(test.verdict != GlobalVerdict::AsStated);
            }
        }
        // The binomial deviation of the rate; three and a half of them are exceeded once in two thousand.
        let deviation = (level * (1.0 - level) / RUNS as f64).sqrt();
        for (index, count) in failed.into_iter().enumerate() {
            let rate = f64::from(count) / RUNS as f64;
            println!("level {level}, test {index}: rate {rate}");
            // "few" has a redundancy of less than one, in unequal parts: two moments do not make its lower tail.
            let least = if index == 1 { level / 4.0 } else { level };
            assert!(
                rate < level + 3.5 * deviation && rate > least - 3.5 * deviation,
                "test {index}: {rate} at {level}"
            );
        }
    }
}

#[test]
fn the_group_with_wrong_deviations_is_named() {
    let solution = solve(3, [1.0, 1.0, 1000.0], Kernel::default());
    assert_eq!(solution.global_test(0.05).unwrap().verdict, GlobalVerdict::TooLarge);
    let solution = solve(3, [0.01, 1.0, 1.0], Kernel::default());
    let tests = solution.group_tests(0.05).unwrap();
    assert_eq!((tests[0].subject.as_str(), tests[0].verdict), ("many", GlobalVerdict::TooSmall));
    assert!(tests[0].to_string().contains("too small"), "{}", tests[0]);
    assert_relative_eq!(tests.iter().map(|test| test.redundancy).sum::<f64>(), 30.0, epsilon = 1e-9);
    assert!(tests[1].redundancy < 1.0 && tests[1].degrees > tests[1].redundancy);
}

#[test]
fn what_cannot_be_tested_is_said() {
    let untestable = |done: Result<GlobalTest, Error>| matches!(done, Err(Error::Untestable { .. }));
    assert!(untestable(GlobalTest::new("x", 1.0, 0.0, 0.05)));
    assert!(untestable(GlobalTest::new("x", f64::NAN, 3.0, 0.05)));
    assert!(matches!(GlobalTest::new("x", 1.0, 3.0, 1.0), Err(Error::Option { name: "level", .. })));
    // Where all residuals are within Huber's limit nothing was weighted down.
    assert!(untestable(solve(3, [1.0, 1.0, 9.0], Kernel::Huber(1.345)).global_test(0.05)));
    assert!(solve(3, [0.3; 3], Kernel::Huber(5.0)).global_test(0.05).is_ok());
}
