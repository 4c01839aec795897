//! Estimation of warm-up and temperature drift against truth: parameters, covariance, verdict.

use crate::drift_captures::{Capture, room_temperature_c, transients, with_temperature};
use error_models::WarmUp;
use warm_up::{DriftEstimate, DriftOptions, DriftVerdict, TemperatureUse, estimate_drift};

fn estimate(capture: &Capture, seed: u64, options: &DriftOptions) -> DriftEstimate {
    estimate_drift(&capture.samples(seed), options).unwrap()
}

/// Mean over seeded runs of the squared error of each parameter over its variance, and of the whole vector's.
fn normalised_squares(capture: &Capture, options: &DriftOptions, runs: u32) -> Vec<f64> {
    let truth = capture.truth.parameter_values();
    let mut sums = vec![0.0; truth.len() + 1];
    for seed in 0..runs {
        let found = estimate(capture, u64::from(seed), options);
        assert_eq!(found.model.parameter_names(), capture.truth.parameter_names(), "seed {seed}: {:?}", found.tests);
        let errors: Vec<f64> = found.model.parameter_values().iter().zip(&truth).map(|(a, b)| a - b).collect();
        for (sum, (error, sigma)) in sums.iter_mut().zip(errors.iter().zip(found.deviations())) {
            *sum += (error / sigma).powi(2) / f64::from(runs);
        }
        let scaled = nalgebra::DVector::from_iterator(
            errors.len(),
            errors.iter().zip(found.deviations()).map(|(error, sigma)| error / sigma),
        );
        let solved = found.correlation().cholesky().unwrap().solve(&scaled);
        sums[truth.len()] += scaled.dot(&solved) / errors.len() as f64 / f64::from(runs);
    }
    sums
}

const RUNS: u32 = 120;

/// Over 120 runs the mean of χ² with one degree of freedom has the deviation √(2 / 120) = 0.13: 2.5 of them.
fn assert_near_one(squares: &[f64]) {
    println!("{squares:.2?}");
    assert!(squares.iter().all(|square| (0.68..1.32).contains(square)), "{squares:.2?}");
}

#[test]
fn covariance_of_one_transient_is_that_of_repeated_estimates() {
    let capture = Capture::new(transients(&[(-0.003, 1200.0)]));
    let options = DriftOptions { level: 1e-5, ..DriftOptions::default() };
    assert_near_one(&normalised_squares(&capture, &options, RUNS));
}

#[test]
fn covariance_of_two_transients_is_that_of_repeated_estimates() {
    let capture = Capture::new(transients(&[(0.004, 300.0), (-0.005, 2400.0)]));
    let options = DriftOptions { level: 1e-5, ..DriftOptions::default() };
    assert_near_one(&normalised_squares(&capture, &options, RUNS));
}

#[test]
fn covariance_holds_for_noise_that_is_correlated_in_time() {
    let capture = Capture { count: 200, correlation: 0.5, ..Capture::new(transients(&[(-0.004, 1200.0)])) };
    let options = DriftOptions { level: 1e-5, ..DriftOptions::default() };
    let squares = normalised_squares(&capture, &options, RUNS);
    // Without the serial correlation they are (1 + 0.5) / (1 - 0.5) = 3.
    assert_near_one(&squares);
}

#[test]
fn covariance_with_a_temperature_is_that_of_repeated_estimates() {
    let mut capture =
        Capture { temperature_c: |time_s| Some(room_temperature_c(time_s)), ..Capture::new(with_temperature()) };
    let options = DriftOptions { level: 1e-5, temperature: TemperatureUse::Estimate, ..DriftOptions::default() };
    // The reference is a mean of the last tenth: amplitudes and coefficients do not depend on it.
    let found = estimate(&capture, 0, &options);
    let reference_c = found.model.temperature.unwrap().reference_c;
    assert!((38.0..42.0).contains(&reference_c));
    capture.truth.temperature.as_mut().unwrap().reference_c = reference_c;
    assert_near_one(&normalised_squares(&capture, &options, RUNS));
}

#[test]
fn corrected_ranges_have_no_trend_and_the_verdict_is_true() {
    let capture = Capture::new(transients(&[(-0.003, 1200.0)]));
    let found = estimate(&capture, 7, &DriftOptions { tolerance_m: Some(2e-4), ..DriftOptions::default() });
    let corrected: Vec<(f64, f64)> = capture
        .samples(8)
        .iter()
        .map(|one| (one.time_s / 1e4, one.mean_change_m - found.model.value(Some(one.time_s), None).unwrap()))
        .collect();
    let n = corrected.len() as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| corrected.iter().map(of).sum::<f64>() / n;
    let (time, range) = (mean(&|one| one.0), mean(&|one| one.1));
    let spread = mean(&|one| (one.0 - time).powi(2));
    let slope = mean(&|one| (one.0 - time) * (one.1 - range)) / spread;
    let sigma = 2e-4 / (n * spread).sqrt();
    // What is corrected carries the error of the model as well, which is as large as that of one capture.
    assert!(slope.abs() < 4.0 * 2.0_f64.sqrt() * sigma, "{slope} against {sigma}");
    let DriftVerdict::Stable { after_s, within_m } = found.verdict else { panic!("{}", found.verdict) };
    let truth = 1200.0 * (0.003_f64 / 2e-4).ln();
    // By the derivatives of tau ln(A / tolerance).
    let slope = nalgebra::DVector::from_vec(vec![-1200.0 / 0.003, (0.003_f64 / 2e-4).ln()]);
    let sigma = slope.dot(&(&found.covariance * &slope)).sqrt();
    assert!((after_s - truth).abs() < 4.0 * sigma && sigma < 100.0, "{after_s} for {truth}, sigma {sigma}");
    // Three deviations of a block of five samples: 3 * 0.2 / sqrt(5) mm, known to a tenth from 50 blocks.
    assert!((2e-4..4e-4).contains(&within_m), "{within_m}");
    let words = format!("stable after {:.1} min, now within ±{:.2} mm", after_s / 60.0, 1e3 * within_m);
    assert_eq!(found.verdict.to_string(), words);
}

#[test]
fn a_tolerance_that_is_not_reached_is_said() {
    let capture = Capture { duration_s: 4000.0, sigma_m: 2e-5, ..Capture::new(transients(&[(-0.003, 1200.0)])) };
    let found = estimate(&capture, 1, &DriftOptions { tolerance_m: Some(1e-5), ..DriftOptions::default() });
    let DriftVerdict::StillDrifts { expected_after_s, remaining_m } = found.verdict else {
        panic!("{}", found.verdict)
    };
    assert!((expected_after_s - 1200.0 * 300.0_f64.ln()).abs() < 100.0, "{expected_after_s}");
    // At the last block, ten seconds before the end.
    assert!((remaining_m + 0.003 * (-4010.0_f64 / 1200.0).exp()).abs() < 5e-6, "{remaining_m}");
}

#[test]
fn a_camera_that_was_warm_is_stable_from_the_begin() {
    let found = estimate(&Capture::new(WarmUp::default()), 3, &DriftOptions::default());
    assert!(found.model.is_empty() && found.covariance.is_empty());
    let DriftVerdict::Stable { after_s, .. } = found.verdict else { panic!("{}", found.verdict) };
    assert!(after_s < 200.0, "{after_s}");
}
