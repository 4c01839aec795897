//! All range errors of the chapter at once while the camera warms up: its drift from a capture of its own, the rest as ever.

use crate::all_effects::{options, samples, values};
use crate::drift_captures::{Capture, transients};
use crate::support::dense::{INTERVAL_M, SIGMA_M, Wall, differences, truth};
use error_models::{RangeErrorModel, WarmUp};
use nalgebra::DVector;
use range_calibration::{RangeDifference, Scale, estimate_range_terms};
use residual_tests::{TrendOptions, TrendVariable, TrendVerdict, test_trends};
use warm_up::{DriftOptions, estimate_drift};

/// Passes over the wall's 16 distances: range and time do not run together then.
const PASSES: u64 = 3;
const PIXELS: usize = 14 * 12;

/// Four centimetres at power-on and 25 minutes to fall to a third, as in the chapter's Fig. 5 and 6.
fn warm_up() -> WarmUp {
    transients(&[(-0.04, 1500.0)])
}

/// A frame a minute, from two minutes after power-on on.
fn time_s(index: usize) -> f64 {
    120.0 + 60.0 * (index / PIXELS) as f64
}

/// The observed ranges of all passes, with the drift of the camera in them.
fn warming(truth: &RangeErrorModel, seed: u64) -> Vec<RangeDifference> {
    let passes = (0..PASSES).flat_map(|pass| differences(truth, Wall::Patches, PASSES * seed + pass));
    let drifted = |(index, d): (usize, RangeDifference)| {
        let shown = |range_m| truth.observed_range(range_m, d.x_mm, d.y_mm, d.amplitude).unwrap();
        let with_drift = d.reference_range_m + warm_up().value(Some(time_s(index)), None).unwrap();
        let observed_range_m = d.observed_range_m + shown(with_drift) - shown(d.reference_range_m);
        RangeDifference { observed_range_m, ..d }
    };
    passes.enumerate().map(drifted).collect()
}

/// The drift is taken off as the terms are: at the observed range. So it stands beside the reference.
fn without_drift(differences: &[RangeDifference], drift: &WarmUp) -> Vec<RangeDifference> {
    let moved = |(index, d): (usize, &RangeDifference)| {
        let reference_range_m = d.reference_range_m + drift.value(Some(time_s(index)), None).unwrap();
        RangeDifference { reference_range_m, ..*d }
    };
    differences.iter().enumerate().map(moved).collect()
}

/// The drift of a capture of a scene at rest.
fn found_drift(seed: u64) -> WarmUp {
    estimate_drift(&Capture::new(warm_up()).samples(seed), &DriftOptions::default()).unwrap().model
}

#[test]
fn the_truth_comes_back_from_a_camera_that_warms_up() {
    let truth = truth(true, true);
    let hyperbola = truth.hyperbola.unwrap();
    let expected: Vec<f64> =
        truth.parameter_values().into_iter().chain([hyperbola.h1, hyperbola.h2, hyperbola.h3]).collect();
    let (mut sum, surveys) = (0.0, 8_u32);
    for seed in 0..u64::from(surveys) {
        let differences = without_drift(&warming(&truth, seed), &found_drift(900 + seed));
        let calibration = estimate_range_terms(&differences, INTERVAL_M, &options()).unwrap();
        let covariance = calibration.covariance(Scale::Prior).unwrap();
        let deviations = covariance.diagonal().map(f64::sqrt);
        let correlation = covariance.component_div(&(&deviations * deviations.transpose()));
        let errors = values(&calibration).into_iter().zip(&expected).map(|(found, truth)| found - truth);
        let error = DVector::from_iterator(expected.len(), errors).component_div(&deviations);
        sum += error.dot(&correlation.lu().solve(&error).unwrap()) / expected.len() as f64;
        assert!(error.amax() < 4.5, "{error:?}");
    }
    let mean = sum / f64::from(surveys);
    println!("normalised squared error {mean:.3} of {} parameters in {surveys} warming surveys", expected.len());
    // χ² of 8 x 24 numbers over their count scatters by sqrt(2 / 192) = 0.10; four of them. The drift is known to some
    // hundredths of a millimetre, which adds nothing to be seen.
    assert!((mean - 1.0).abs() < 0.41, "{mean}");
}

#[test]
fn nothing_is_left_in_time_once_the_drift_is_off() {
    let truth = truth(true, true);
    for seed in 0..3 {
        let observed = warming(&truth, 100 + seed);
        let verdict = |differences: &[RangeDifference]| {
            let calibration = estimate_range_terms(differences, INTERVAL_M, &options()).unwrap();
            let left = samples(differences, calibration.residuals_m().iter().copied());
            let report = test_trends(&left, &TrendOptions::default()).unwrap();
            (calibration.rms_after_m(), report)
        };
        let (rms_m, report) = verdict(&without_drift(&observed, &found_drift(950 + seed)));
        // 8064 differences know the rms to 0.8 %.
        assert!((rms_m / SIGMA_M - 1.0).abs() < 0.035, "{rms_m}");
        assert!(
            report.is_random() && report.tests.iter().all(|test| test.verdict == TrendVerdict::Random),
            "{report:?}"
        );
        let (drifting_m, report) = verdict(&observed);
        println!("rms {rms_m:.4} m without the drift, {drifting_m:.4} m with it");
        assert!(report.trends().any(|test| test.variable == TrendVariable::Time), "{report:?}");
    }
}
