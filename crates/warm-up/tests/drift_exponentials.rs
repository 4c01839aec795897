//! How many exponentials a drift has: false alarms at the stated level, planted ones found.

use crate::drift_captures::{Capture, transients};
use error_models::WarmUp;
use warm_up::{DriftOptions, estimate_drift};

/// How often one exponential more than there is was found.
fn false_alarms(capture: &Capture, options: &DriftOptions, runs: u64) -> u64 {
    let there = capture.truth.transients.len();
    let more = |seed: &u64| match estimate_drift(&capture.samples(1000 + seed), options) {
        Ok(found) => found.model.transients.len() > there,
        // A further exponential as slow as the capture.
        Err(warm_up::DriftError::ShorterThanTimeConstant { .. }) => true,
        Err(error) => panic!("seed {seed}: {error}"),
    };
    (0..runs).filter(more).count() as u64
}

#[test]
fn noise_makes_no_more_exponentials_than_the_level_says() {
    let options = DriftOptions { level: 0.05, ..DriftOptions::default() };
    let (none, one) = (WarmUp::default(), transients(&[(-0.003, 1200.0)]));
    for truth in [none, one] {
        for (correlation, count) in [(0.0, 600), (0.5, 200)] {
            let capture = Capture { count, correlation, ..Capture::new(truth.clone()) };
            let found = false_alarms(&capture, &options, 150);
            println!("{} there, correlation {correlation}: {found} of 150", truth.transients.len());
            // 7.5 expected, deviation 2.7: four of them above.
            assert!(found <= 18, "{found}");
        }
    }
}

#[test]
fn both_exponentials_are_found_where_they_are() {
    let capture = Capture::new(transients(&[(0.003, 400.0), (-0.004, 2400.0)]));
    for seed in 0..30 {
        let found = estimate_drift(&capture.samples(seed), &DriftOptions::default()).unwrap();
        assert_eq!(found.model.transients.len(), 2, "{:?}", found.tests);
    }
}
