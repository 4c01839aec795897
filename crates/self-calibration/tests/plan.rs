//! Planned networks.

use crate::support::networks::{all_but_long_wave, small, weak};
use self_calibration::{
    CalibrationOptions, CandidateGrid, Error, NetworkError, PlanOptions, SightingOptions, TermSelection, calibrate,
    plan, simulate_sightings,
};

fn options(candidates: CandidateGrid) -> PlanOptions {
    PlanOptions { terms: TermSelection::List(all_but_long_wave()), candidates, ..PlanOptions::default() }
}

fn no_candidates() -> CandidateGrid {
    CandidateGrid { distances_m: Vec::new(), ..CandidateGrid::default() }
}

#[test]
fn the_plan_promises_what_the_calibration_gives() {
    let promised = plan(&small(), &options(no_candidates())).unwrap();
    let observed = simulate_sightings(&small(), &SightingOptions::default()).unwrap();
    let terms = TermSelection::List(all_but_long_wave());
    let given =
        calibrate(&observed, &CalibrationOptions { terms, rejection_level: None, ..Default::default() }).unwrap();
    assert_eq!(promised.estimated, given.estimated);
    assert_eq!((promised.observations, promised.redundancy), (given.observations, given.redundancy));
    for name in &promised.estimated {
        let planned = promised.parameters.iter().find(|parameter| parameter.name == *name).unwrap().sigma_prior;
        let reached = given.parameter(name).unwrap().sigma_prior;
        // The design is taken at the truth, the calibration at its estimate.
        assert!((planned / reached - 1.0).abs() < 0.05, "{name}: {planned} {reached}");
    }
    assert!(promised.diagnosis[0].contains("accept"));
    assert_eq!(promised.point_sigma_m.len(), 3);
    assert!(
        promised.point_sigma_m.iter().all(|(_, sigma)| *sigma > 0.0005 && *sigma < 0.02),
        "{:?}",
        promised.point_sigma_m
    );
}

#[test]
fn a_weak_plan_is_told_and_a_convergent_station_helps_most() {
    let grid = CandidateGrid { distances_m: vec![2.5], convergence_deg: vec![0.0, 35.0], roll_deg: vec![0.0] };
    let terms = ["xp", "yp", "c", "k1", "d0"].map(str::to_owned).to_vec();
    let options = PlanOptions { terms: TermSelection::List(terms), ..options(grid) };
    let outcome = plan(&weak(), &options).unwrap();
    assert!(outcome.diagnosis[0].contains("refuse"), "{:?}", outcome.diagnosis);
    let best = &outcome.candidates[0];
    assert!(best.description.contains("35 degrees"), "{}", best.description);
    assert!(best.score < 0.0 && best.gain.iter().all(|(_, gain)| *gain < 1.001), "{best:?}");
    let front = outcome.candidates.iter().find(|candidate| candidate.description.contains("in front")).unwrap();
    assert!(best.score < front.score);
}

#[test]
fn a_plan_without_places_is_refused_by_name() {
    let mut planned = small();
    planned.stations[3].world_from_camera = None;
    match plan(&planned, &options(no_candidates())) {
        Err(Error::Network(NetworkError::NotReachable { name, .. })) => assert_eq!(name, "S03"),
        other => panic!("{other:?}"),
    }
}
