//! Epochs left out, predicted camera by camera.

use rig_calibration::self_calibration::{HoldOut, Prediction};
use rig_calibration::{Error, Rig, calibrate_rig, hold_out};

use crate::rigs::{LENS, NAMES, TERMS, knocked, observed, options};

/// E03 and E07 are left out, and E09, which the left camera does not see.
const EVERY: usize = 4;

fn checks(rig: &Rig, terms: &str) -> Vec<HoldOut> {
    let options = options(terms);
    let outcome = calibrate_rig(rig, &options).unwrap();
    hold_out(rig, &options, &outcome, EVERY).unwrap()
}

/// Squared innovations and redundancy of all predictions of a sound rig.
fn innovations(checks: &[HoldOut]) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for (name, check) in NAMES.iter().zip(checks) {
        assert!(!check.fails(), "{name}: {check:?}");
        for part in [Some(&check.image), check.range.as_ref()].into_iter().flatten() {
            let test = part.test.as_ref().unwrap();
            sums = [sums[0] + test.statistic, sums[1] + test.redundancy];
        }
    }
    sums
}

#[test]
fn sound_rigs_predict_what_they_have_not_seen() {
    let mut sums = [0.0; 2];
    for seed in [11, 12] {
        let rig = observed(seed, 0.002);
        let options = options(TERMS);
        let outcome = calibrate_rig(&rig, &options).unwrap();
        let check = |every: usize| hold_out(&rig, &options, &outcome, every).unwrap();
        // What is left out lies between the distances of the others: noise of 8 mm, and little beside it.
        let between = check(5);
        let ranges: Vec<f64> = between.iter().filter_map(|check| Some(check.range.as_ref()?.rms)).collect();
        assert!(ranges.len() == 2 && ranges.iter().all(|rms| (0.006..0.011).contains(rms)), "{ranges:?}");
        // The right camera has nothing beyond 3.2 m then: its waves run on for nearly a metre, to centimetres, as their
        // covariance says.
        let beyond = check(EVERY);
        assert!(beyond[2].range.is_none() && beyond[0].stations == ["E03", "E07"], "{:?}", beyond[0].stations);
        assert!(beyond[1].range.as_ref().unwrap().rms > 2.0 * ranges[1], "{beyond:?}");
        for (name, check) in NAMES.iter().zip(&beyond) {
            // The noise is 0.05 pixel (grey: 0.1); what is predicted adds little.
            let sigma = if *name == "grey" { 0.1 } else { 0.05 };
            assert!((0.9 * sigma..1.6 * sigma).contains(&check.image.rms), "{name}: {}", check.image.rms);
        }
        for own in [innovations(&between), innovations(&beyond)] {
            sums = [sums[0] + own[0], sums[1] + own[1]];
        }
    }
    // Squared innovations in their own variances: one in the mean, here within four deviations.
    let [statistic, degrees] = sums;
    println!("{statistic:.0} of {degrees}");
    let ratio: f64 = statistic / degrees;
    assert!((ratio - 1.0).abs() < 4.0 * (2.0 / degrees).sqrt(), "{ratio}");
}

#[test]
fn a_missing_term_and_a_camera_that_moved_are_told() {
    // The waves of 3 to 9 mm are not among the terms.
    let lacking = checks(&observed(5, 0.0), &format!("{LENS} d0 e1 e2"));
    assert!(lacking.iter().any(|check| check.range.as_ref().is_some_and(Prediction::fails)), "{lacking:?}");

    // The right camera sat two millimetres aside at one of the epochs left out: too little to be refused.
    let told = checks(&knocked(6, 0.002), TERMS);
    assert!(told[1].image.fails(), "{:?}", told[1].image);
}

#[test]
fn what_cannot_be_left_out_is_refused() {
    let (rig, options) = (observed(5, 0.0), options(TERMS));
    let outcome = calibrate_rig(&rig, &options).unwrap();
    for every in [0, 1, 100] {
        let refused = hold_out(&rig, &options, &outcome, every);
        assert!(matches!(refused, Err(Error::Calibration(_))), "{every}");
    }
}
