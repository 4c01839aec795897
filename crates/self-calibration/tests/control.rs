//! Control is tested as observations are, and terms that nothing shows are refused.

use crate::support::networks::{all_but_long_wave, nominal, small};
use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3};
use self_calibration::{
    CalibrationOptions, CalibrationOutcome, Component, Method, Network, NetworkDatum, ObservationQuality,
    SightingOptions, TermSelection, Verdict, calibrate, simulate_sightings,
};

/// Standard deviation of control coordinates, metre.
const SIGMA_M: f64 = 0.0003;

/// Every other target is control, known to 0.3 mm, with errors of that size.
fn observed(seed: u64) -> Network {
    let truth = small();
    let mut network = simulate_sightings(&truth, &SightingOptions { seed, ..SightingOptions::default() }).unwrap();
    nominal(&mut network);
    for (index, target) in network.targets.iter_mut().enumerate().step_by(2) {
        // The sum of twelve values spread evenly has a standard deviation of one.
        let mut state = seed.wrapping_mul(97).wrapping_add(index as u64);
        let mut even = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut normal = || SIGMA_M * ((0..12).map(|_| even()).sum::<f64>() - 6.0);
        let error = Vector3::new(normal(), normal(), normal());
        target.point = Some(truth.targets[index].point.unwrap() + error);
        target.covariance = Some(Matrix3::identity() * SIGMA_M.powi(2));
    }
    network
}

fn solve(network: &Network) -> CalibrationOutcome {
    let terms = TermSelection::List(all_but_long_wave());
    let options = CalibrationOptions { terms, datum: NetworkDatum::Control, ..CalibrationOptions::default() };
    calibrate(network, &options).unwrap()
}

/// Names of rejected control, and the number of rejected values of other kinds.
fn rejected(outcome: &CalibrationOutcome) -> (Vec<String>, usize) {
    let all = || outcome.residuals.iter().filter(|quality| quality.verdict == Verdict::Rejected);
    let control = all().filter(|quality| quality.component == Component::Control);
    let mut names: Vec<String> = control.map(|quality| format!("{}{}", quality.station, quality.target)).collect();
    names.dedup();
    (names, all().filter(|quality| quality.component != Component::Control).count())
}

#[test]
fn sound_control_is_kept() {
    for seed in 0..10 {
        let outcome = solve(&observed(seed));
        let (control, others) = rejected(&outcome);
        assert!(control.is_empty() && others <= 3 && outcome.doubts.is_empty(), "{seed}: {control:?} {others}");
    }
}

/// The error of a component of the control that is found with 80 %, the component alone.
fn smallest_detectable(outcome: &CalibrationOutcome, station: &str, target: &str, component: usize) -> f64 {
    let own = |quality: &&ObservationQuality| {
        quality.component == Component::Control && quality.station == station && quality.target == target
    };
    outcome.residuals.iter().filter(own).nth(component).unwrap().smallest_detectable
}

/// Twice what is found with 80 %, and thirty centimetres.
#[test]
fn a_point_that_is_off_is_rejected_alone() {
    for (seed, index, axis, times) in
        [(20, 0, 0, 2.0), (21, 22, 1, 2.0), (22, 46, 2, 2.0), (23, 20, 0, 2.0), (24, 46, 1, 0.0)]
    {
        let mut network = observed(seed);
        let name = network.targets[index].name.clone();
        let detectable = smallest_detectable(&solve(&network), "", &name, axis);
        let off = if times > 0.0 { times * detectable } else { 0.3 };
        network.targets[index].point.as_mut().unwrap()[axis] += off;
        let outcome = solve(&network);
        let (control, others) = rejected(&outcome);
        assert!(control == [name.clone()] && others <= 3, "{off} m of {name}: {control:?} and {others} others");
        let told = outcome.doubts.iter().any(|doubt| doubt.contains(&format!("control point `{name}`")));
        assert!(told, "{:?}", outcome.doubts);
        // It is placed by its observations now.
        let found = outcome.targets.iter().find(|target| target.name == name).unwrap();
        let error = found.point - small().targets[index].point.unwrap();
        let square = error.dot(&(found.covariance.try_inverse().unwrap() * error));
        assert!(square < 21.1, "{name}: {square} where 0.01 % exceed 21.1");
    }
}

#[test]
fn a_pose_that_is_off_is_rejected_alone() {
    let sigmas = [0.001, 0.001, 0.001, 0.001, 0.001, 0.001_f64];
    let truth = small();
    for (station, component) in [(1, 0), (6, 4), (8, 2)] {
        let mut network = observed(5);
        for (given, place) in network.stations.iter_mut().zip(&truth.stations) {
            given.world_from_camera = place.world_from_camera;
            given.covariance = Some(Matrix6::from_diagonal(&sigmas.map(|sigma| sigma * sigma).into()));
        }
        let name = network.stations[station].name.clone();
        let off = 2.0 * smallest_detectable(&solve(&network), &name, "", component);
        let mut parts = [0.0; 6];
        parts[component] = off;
        let [x, y, z, a, b, c] = parts;
        let pose = network.stations[station].world_from_camera.as_mut().unwrap();
        pose.translation.vector += Vector3::new(x, y, z);
        pose.rotation *= UnitQuaternion::from_scaled_axis(Vector3::new(a, b, c));
        let outcome = solve(&network);
        let (control, others) = rejected(&outcome);
        assert!(control == [name.clone()] && others <= 3, "{name} by {off}: {control:?} and {others} others");
        assert!(
            outcome.doubts.iter().any(|doubt| doubt.contains(&format!("station `{name}`"))),
            "{:?}",
            outcome.doubts
        );
    }
}

#[test]
fn terms_that_nothing_shows_are_refused() {
    let ranges = ["d0", "d4", "e1", "spline6"];
    for (term, method) in
        ranges.into_iter().zip([Method::OneStep, Method::OneStep, Method::TwoStepDependent, Method::OneStep])
    {
        let mut network = observed(0);
        network.sightings.iter_mut().for_each(|seen| seen.range_m = None);
        let terms = TermSelection::List(["c", "k1", term].map(str::to_owned).to_vec());
        let options =
            CalibrationOptions { terms, method, datum: NetworkDatum::Control, ..CalibrationOptions::default() };
        let said = calibrate(&network, &options).unwrap_err().to_string();
        assert!(said.contains("ranges"), "{term}: {said}");
    }
}
