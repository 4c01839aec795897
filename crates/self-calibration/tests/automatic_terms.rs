//! The automatic choice of terms.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod support;

use self_calibration::{CalibrationOptions, Method, SightingOptions, calibrate, simulate_sightings};
use support::networks::{nominal, small, track_network};

#[test]
fn what_acts_is_taken_and_the_long_wave_has_to_earn_its_place() {
    let mut observed = simulate_sightings(&small(), &SightingOptions::default()).unwrap();
    nominal(&mut observed);
    let outcome = calibrate(&observed, &CalibrationOptions::default()).unwrap();
    for name in ["xp", "yp", "c", "k1", "d0", "d4", "d5", "d6", "d7", "e1", "e2"] {
        assert!(outcome.estimated.iter().any(|known| known == name), "{name} in {:?}", outcome.estimated);
    }
    // No wave of length U, no affinity, no shear, no k3 in the truth.
    for name in ["d2", "b1", "k3"] {
        let decision = outcome.decisions.iter().find(|decision| decision.terms[0] == name).unwrap();
        assert!(!decision.taken && !decision.reason.is_empty(), "{decision:?}");
    }
    let long_wave = outcome.decisions.iter().find(|decision| decision.terms[0] == "d2").unwrap();
    assert!(long_wave.reason.contains("d0 is"), "{}", long_wave.reason);
}

#[test]
fn a_track_over_the_whole_interval_shows_the_long_wave() {
    let mut truth = track_network();
    truth.range_model.terms.periodic[0] = 0.008;
    let observed = simulate_sightings(&truth, &SightingOptions { sigma_range_m: 0.002, ..Default::default() }).unwrap();
    let options = CalibrationOptions { method: Method::Laboratory, ..CalibrationOptions::default() };
    let outcome = calibrate(&observed, &options).unwrap();
    assert!(outcome.estimated.iter().any(|name| name == "d2"), "{:?}", outcome.decisions);
    let d2 = outcome.parameter("d2").unwrap();
    assert!((d2.value - 0.008).abs() < 4.0 * d2.sigma_prior);
}
