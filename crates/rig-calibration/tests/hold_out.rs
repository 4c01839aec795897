//! Epochs left out, predicted camera by camera.

use rig_calibration::nalgebra::Isometry3;
use rig_calibration::self_calibration::{HoldOut, Prediction, simulate_sightings};
use rig_calibration::{Error, Rig, RigCamera, calibrate_rig, hold_out};

use crate::rigs::{LENS, NAMES, TERMS, observed, options, sightings, truth};

/// E03 and E07 are left out, and E09, which the left camera does not see.
const EVERY: usize = 4;

fn checks(rig: &Rig, terms: &str) -> Vec<HoldOut> {
    let options = options(terms);
    let outcome = calibrate_rig(rig, &options).unwrap();
    hold_out(rig, &options, &outcome, EVERY).unwrap()
}

#[test]
fn sound_rigs_predict_what_they_have_not_seen() {
    let (mut statistic, mut degrees) = (0.0, 0.0);
    for seed in [11, 12] {
        let checks = checks(&observed(seed, 0.002), TERMS);
        assert_eq!(checks.len(), 3);
        assert!(checks[2].range.is_none() && checks[0].stations == ["E03", "E07"], "{:?}", checks[0].stations);
        for (name, check) in NAMES.iter().zip(&checks) {
            assert!(!check.fails(), "{seed} {name}: {check:?}");
            for part in [Some(&check.image), check.range.as_ref()].into_iter().flatten() {
                let test = part.test.as_ref().unwrap();
                (statistic, degrees) = (statistic + test.statistic, degrees + test.redundancy);
            }
            // The noise is 0.05 pixel (grey: 0.1) and 8 mm. Image points are predicted well; the offset of the ranges follows from
            // so few epochs to some centimetres only, which the test above allows for.
            let sigma = if *name == "grey" { 0.1 } else { 0.05 };
            assert!((0.9 * sigma..1.6 * sigma).contains(&check.image.rms), "{name}: {}", check.image.rms);
            assert!(check.range.as_ref().is_none_or(|range| (0.006..0.06).contains(&range.rms)), "{check:?}");
        }
    }
    // Squared innovations in their own variances: one in the mean, here within four deviations.
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
    let mut rig = observed(6, 0.0);
    let mut moved = truth(1);
    for station in moved.stations.iter_mut().filter(|station| station.name == "E07") {
        station.world_from_camera =
            station.world_from_camera.map(|pose| pose * Isometry3::translation(0.002, 0.0, 0.0));
    }
    let right: &mut RigCamera = &mut rig.cameras[1];
    right.network.sightings = simulate_sightings(&moved, &sightings(6, 1)).unwrap().sightings;
    let told = checks(&rig, TERMS);
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
