//! A calibration whose residuals are not what was stated says so.

use crate::support::networks::{all_but_long_wave, nominal, small};
use self_calibration::{
    CalibrationOptions, CalibrationOutcome, GlobalVerdict, Method, SightingOptions, TermSelection, calibrate,
    simulate_sightings,
};

/// The small network where deviations of image points and ranges are stated so many times as large as they are.
fn outcome(seed: u64, stated: [f64; 2], method: Method) -> CalibrationOutcome {
    let mut network = simulate_sightings(&small(), &SightingOptions { seed, ..SightingOptions::default() }).unwrap();
    nominal(&mut network);
    for seen in &mut network.sightings {
        seen.sigma_pixel = seen.sigma_pixel.map(|sigma| stated[0] * sigma);
        seen.sigma_range_m *= stated[1];
    }
    let terms = TermSelection::List(all_but_long_wave());
    calibrate(&network, &CalibrationOptions { terms, method, ..CalibrationOptions::default() }).unwrap()
}

#[test]
fn sound_networks_pass() {
    for method in [Method::OneStep, Method::TwoStepDependent] {
        for seed in 0..12 {
            let outcome = outcome(seed, [1.0; 2], method);
            assert!(outcome.doubts.is_empty(), "{method:?} {seed}: {:?}", outcome.doubts);
            let tests = outcome.global_tests();
            assert!(tests.len() == 4 && tests.iter().all(|test| test.verdict == GlobalVerdict::AsStated), "{tests:?}");
        }
    }
}

/// A fifth off is told, and of the group that it is of.
#[test]
fn deviations_that_are_not_true_are_told_by_their_group() {
    for (stated, groups, verdict) in [
        ([1.0, 0.8], vec!["range"], GlobalVerdict::TooLarge),
        ([1.0, 1.25], vec!["range"], GlobalVerdict::TooSmall),
        ([0.8, 1.0], vec!["col", "row"], GlobalVerdict::TooLarge),
        ([5.0, 5.0], vec!["col", "row", "range"], GlobalVerdict::TooSmall),
        ([0.2, 0.2], vec!["col", "row", "range"], GlobalVerdict::TooLarge),
    ] {
        let outcome = outcome(3, stated, Method::OneStep);
        let tests = outcome.global_tests();
        let failed: Vec<&str> =
            tests.iter().filter(|test| test.verdict == verdict).map(|test| test.subject.as_str()).collect();
        assert!(groups.iter().all(|group| failed.contains(group)), "{stated:?}: {failed:?}");
        assert_eq!(outcome.doubts.len(), groups.len(), "{stated:?}: {:?}", outcome.doubts);
        for (doubt, group) in outcome.doubts.iter().zip(&groups) {
            assert!(doubt.starts_with(&format!("{group} scatters")), "{doubt}");
        }
    }
}
