//! Networks that do not determine their parameters are refused with what to add.

use crate::support::networks::{all_but_long_wave, looking, nominal, normal, small, weak};
use self_calibration::{
    CalibrationOptions, Error, Method, Network, NetworkError, SightingOptions, TermSelection, calibrate,
    simulate_sightings,
};

fn calibrated(truth: &Network, terms: &[&str], method: Method) -> Result<Vec<String>, Error> {
    let mut observed = simulate_sightings(truth, &SightingOptions::default()).unwrap();
    nominal(&mut observed);
    let terms = TermSelection::List(terms.iter().map(ToString::to_string).collect());
    let options = CalibrationOptions { terms, method, ..CalibrationOptions::default() };
    calibrate(&observed, &options).map(|outcome| outcome.diagnosis)
}

fn refused(truth: &Network, terms: &[&str], method: Method) -> (String, f64, String) {
    match calibrated(truth, terms, method) {
        Err(Error::Network(NetworkError::WeakNetwork { combination, inflation, advice, correlation })) => {
            assert!(correlation.contains("correlation") || correlation.contains("reference"), "{correlation}");
            println!("refused: {combination}, inflation {inflation:.0}; {advice}");
            (combination, inflation, advice)
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn stations_at_one_distance_leave_the_offset_open() {
    for method in [Method::OneStep, Method::TwoStepDependent] {
        let (combination, inflation, advice) = refused(&weak(), &["c", "k1", "d0", "e1", "e2"], method);
        assert!(combination.contains("d0") || combination.contains(" c"), "{combination}");
        assert!(inflation > 500.0);
        assert!(advice.contains("convergent stations"), "{advice}");
    }
}

#[test]
fn a_camera_that_is_never_rolled_is_told_to() {
    let mut upright = small();
    for (index, station) in (0..).zip(upright.stations.iter_mut()) {
        station.world_from_camera = Some(looking(1.5 + 0.2 * f64::from(index), 0.0, 0.0, 0.0));
    }
    let all = all_but_long_wave();
    let all: Vec<&str> = all.iter().map(String::as_str).collect();
    let (combination, _, advice) = refused(&upright, &all, Method::OneStep);
    assert!(combination.contains("xp"), "{combination}");
    assert!(advice.contains("roll the camera by 90 degrees"), "{advice}");
}

#[test]
fn the_normal_network_passes_and_the_long_wave_is_told() {
    let all = all_but_long_wave();
    let mut all: Vec<&str> = all.iter().map(String::as_str).collect();
    let said = calibrated(&normal(), &all, Method::OneStep).unwrap();
    assert!(!said.iter().any(|sentence| sentence.contains("weakest")), "{said:?}");
    all.extend(["d2", "d3"]);
    let said = calibrated(&normal(), &all, Method::OneStep).unwrap().join(" ");
    println!("accepted: {said}");
    assert!(said.contains("d0") && said.contains("d2") && said.contains("distance"), "{said}");
}

#[test]
fn with_all_terms_the_answer_is_the_same() {
    let all = all_but_long_wave();
    let all: Vec<&str> = all.iter().map(String::as_str).collect();
    let (combination, inflation, advice) = refused(&weak(), &all, Method::OneStep);
    // Another least squares ends with d0 = 6.2 m and a covariance.
    assert!(combination.contains("d0") && inflation > 1e3, "{combination} {inflation}");
    assert!(advice.contains("stations at other distances"), "{advice}");
    let mut observed = simulate_sightings(&weak(), &SightingOptions::default()).unwrap();
    nominal(&mut observed);
    let answer = calibrate(&observed, &CalibrationOptions::default());
    assert!(
        matches!(answer, Err(Error::Network(NetworkError::WeakNetwork { .. }))),
        "{:?}",
        answer.map(|outcome| outcome.estimated)
    );
}
