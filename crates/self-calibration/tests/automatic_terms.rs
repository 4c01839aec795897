//! The automatic choice of terms.

use crate::support::cases::{calibrated, cases, errors};
use crate::support::networks::{nominal, range_model, small, track_network, weak};
use error_models::{PeriodicSpline, RangeErrorModel, RangeTerms};
use self_calibration::{
    CalibrationOptions, CalibrationOutcome, Error, Method, Network, NetworkError, SightingOptions, TermDecision,
    calibrate, simulate_sightings,
};

fn spline_decision(outcome: &CalibrationOutcome) -> &TermDecision {
    outcome.decisions.iter().find(|decision| decision.terms[0] == "spline12").unwrap()
}

/// A track over the whole interval, calibrated with whatever terms speak for themselves.
fn of_a_track(model: RangeErrorModel) -> CalibrationOutcome {
    let truth = Network { range_model: model, ..track_network() };
    let mut observed =
        simulate_sightings(&truth, &SightingOptions { sigma_range_m: 0.002, ..Default::default() }).unwrap();
    observed.range_model = RangeErrorModel::error_free(truth.range_model.ambiguity_interval_m);
    let options = CalibrationOptions { method: Method::Laboratory, ..CalibrationOptions::default() };
    calibrate(&observed, &options).unwrap()
}

#[test]
fn sines_stay_where_they_are_the_truth() {
    let outcome = of_a_track(range_model());
    let decision = spline_decision(&outcome);
    assert!(!decision.taken && decision.delta_bic > 0.0 && decision.reason.contains("sines stay"), "{decision:?}");
    assert!(outcome.estimated.iter().any(|name| name == "d6") && outcome.range_models[0].1.further.is_empty());
}

#[test]
fn a_spline_replaces_sines_that_cannot_follow() {
    let mut model = range_model();
    model.terms = RangeTerms { periodic: [0.0; 6], ..model.terms };
    let coefficients = vec![0.0, 0.0, 0.03, -0.03, 0.0, 0.0, 0.0, 0.02, 0.0, -0.02, 0.0];
    model.further.spline = Some(PeriodicSpline { coefficients });
    let outcome = of_a_track(model);
    let decision = spline_decision(&outcome);
    assert!(decision.taken && decision.delta_bic < -10.0, "{decision:?}");
    assert!(outcome.estimated.iter().any(|name| name == "s3"), "{:?}", outcome.estimated);
    let s3 = outcome.parameter("s3").unwrap();
    assert!((s3.value + 0.03).abs() < 4.0 * s3.sigma_prior, "{s3:?}");
    let sines = outcome.decisions.iter().filter(|decision| decision.terms[0] == "d4" || decision.terms[0] == "d6");
    assert!(sines.into_iter().all(|decision| !decision.taken), "{:?}", outcome.decisions);
}

#[test]
fn what_acts_is_taken_and_the_long_wave_has_to_earn_its_place() {
    let mut observed = simulate_sightings(&small(), &SightingOptions::default()).unwrap();
    nominal(&mut observed);
    let outcome = calibrate(&observed, &CalibrationOptions::default()).unwrap();
    for name in ["xp", "yp", "c", "k1", "d0", "d4", "d5", "d6", "d7", "e1", "e2"] {
        assert!(outcome.estimated.iter().any(|known| known == name), "{name} in {:?}", outcome.estimated);
    }
    // No wave of length U, no affinity, no shear, no k3 in the truth: what cameras show of them is all that is known.
    for name in ["d2", "b1", "k3"] {
        let decision = outcome.decisions.iter().find(|decision| decision.terms[0] == name).unwrap();
        assert!(!decision.taken && !decision.reason.is_empty(), "{decision:?}");
    }
    let long_wave = outcome.decisions.iter().find(|decision| decision.terms[0] == "d2").unwrap();
    assert!(long_wave.reason.contains("d0 is"), "{}", long_wave.reason);
    // Ranges from 1.2 m to 4.5 m.
    let spline = spline_decision(&outcome);
    assert!(!spline.taken && spline.reason.contains("ambiguity interval of 5.00 m"), "{spline:?}");
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

#[test]
fn deviations_hold_by_every_method_whatever_waves_the_camera_has() {
    // A wave of length U looks like an offset over the ranges of most networks, which is why it has to stay in the doubt.
    for wave in [[0.0, 0.0], [0.015, -0.02]] {
        let (mut square, mut unknowns) = (0.0, 0);
        for mut case in cases() {
            case.truth.range_model.terms.periodic[..2].copy_from_slice(&wave);
            for seed in 1..=2 {
                let sightings = SightingOptions { seed, ..SightingOptions::default() };
                let outcome = calibrated(&case, &sightings, &CalibrationOptions::default());
                let errors = errors(&case, &outcome);
                let own = errors.dot(&outcome.covariance.clone().cholesky().unwrap().solve(&errors));
                println!("{}, seed {seed}: {:.2} per unknown", case.name, own / errors.len() as f64);
                // A thousandth of chi-squared of 16 unknowns or more is beyond 2.5.
                assert!(own < 2.5 * errors.len() as f64, "{}, seed {seed}: {own} of {}", case.name, errors.len());
                square += own;
                unknowns += errors.len();
            }
        }
        let mean = square / f64::from(u32::try_from(unknowns).unwrap());
        println!("wave {wave:?}: {mean:.3}");
        // Terms that are not there and that the observations leave open are exact.
        assert!((0.6..1.15).contains(&mean), "{mean}");
    }
}

#[test]
fn a_network_that_leaves_all_terms_open_is_refused_and_not_answered_with_fewer() {
    let mut observed = simulate_sightings(&weak(), &SightingOptions::default()).unwrap();
    nominal(&mut observed);
    match calibrate(&observed, &CalibrationOptions::default()) {
        Err(Error::Network(NetworkError::WeakNetwork { combination, inflation, .. })) => {
            println!("{combination}: {inflation:.0}");
        }
        other => panic!("{:?}", other.map(|outcome| outcome.parameters)),
    }
}

#[test]
fn two_stations_say_how_little_they_tell() {
    let mut truth = small();
    truth.stations.truncate(2);
    for seed in 1..=4 {
        let mut observed = simulate_sightings(&truth, &SightingOptions { seed, ..SightingOptions::default() }).unwrap();
        nominal(&mut observed);
        match calibrate(&observed, &CalibrationOptions::default()) {
            Ok(outcome) => {
                let c = outcome.parameter("c").unwrap();
                println!("c {:.3} +- {:.3} mm", c.value, c.sigma_prior);
                assert!((c.value - truth.camera.interior.principal_distance_mm).abs() < 4.0 * c.sigma_prior, "{c:?}");
            }
            Err(error) => println!("{error}"),
        }
    }
}
