//! Networks that cannot be used are refused by name.

use crate::support::networks::{all_but_long_wave, small};
use nalgebra::Matrix3;
use self_calibration::{
    CalibrationOptions, CalibrationOutcome, Error, Method, Network, NetworkDatum, SightingOptions, SimulatedStart,
    TermSelection, calibrate, calibrate_two_networks, simulate_sightings,
};

fn observed() -> Network {
    simulate_sightings(&small(), &SightingOptions::default()).unwrap()
}

fn options() -> CalibrationOptions {
    CalibrationOptions { terms: TermSelection::List(all_but_long_wave()), ..CalibrationOptions::default() }
}

/// What a calibration says of a network with this wrong.
fn answer(spoil: impl Fn(&mut Network, &mut CalibrationOptions)) -> String {
    let (mut network, mut options) = (observed(), options());
    spoil(&mut network, &mut options);
    message(calibrate(&network, &options))
}

fn message(answer: Result<CalibrationOutcome, Error>) -> String {
    match answer {
        Err(error) => error.to_string(),
        Ok(outcome) => panic!("accepted with sigma0 {:?}", outcome.sigma0),
    }
}

#[test]
fn names_and_numbers() {
    let said = answer(|network, _| network.stations[1].name = "S00".to_owned());
    assert!(said.contains("two stations") && said.contains("`S00`"), "{said}");
    let said = answer(|network, _| network.targets[1].name = "T00".to_owned());
    assert!(said.contains("two targets") && said.contains("`T00`"), "{said}");
    let said = answer(|network, _| network.sightings[5].sigma_range_m = 0.0);
    assert!(said.contains("sigma of the range = 0") && said.contains("from station `S00`"), "{said}");
    let said = answer(|network, _| network.sightings[5].sigma_pixel[1] = f64::NAN);
    assert!(said.contains("sigma of the image point"), "{said}");
    let said = answer(|network, _| network.sightings[5].pixel = None);
    assert!(said.contains("image point"), "{said}");
    let said = answer(|network, _| network.sightings[5].station = 99);
    assert!(said.contains("number 99"), "{said}");
    let said = answer(|_, options| options.without_ranges = vec!["S99".to_owned()]);
    assert!(said.contains("`S99`") && said.contains("S03"), "{said}");
    let said = answer(|_, options| options.terms = TermSelection::List(vec!["q9".to_owned()]));
    assert!(said.contains("`q9`"), "{said}");
    let said = answer(|_, options| options.rejection_level = Some(2.0));
    assert!(said.contains("rejection_level"), "{said}");
    let said = answer(|network, _| network.targets[2].covariance = Some(Matrix3::zeros()));
    assert!(said.contains("`T02`"), "{said}");
}

#[test]
fn too_little_seen() {
    let said = answer(|network, _| {
        let mut left = 2;
        network.sightings.retain(|seen| {
            left -= i32::from(seen.station == 4);
            seen.station != 4 || left >= 0
        });
    });
    assert!(said.contains("station `S04`") && said.contains("2 targets"), "{said}");
    let said = answer(|network, _| {
        let first = network.sightings.iter().position(|seen| seen.target == 20).unwrap();
        network.sightings[first].range_m = None;
        let mut index = 0;
        network.sightings.retain(|seen| {
            index += 1;
            seen.target != 20 || index == first + 1
        });
    });
    assert!(said.contains("target `T20`") && said.contains("1 sighting"), "{said}");
    let said = answer(|network, _| {
        network.sightings.clear();
    });
    assert!(said.contains("station `S00`"), "{said}");
    let said = answer(|network, _| network.stations.clear());
    assert!(!said.is_empty());
}

#[test]
fn datum_and_methods() {
    let said = answer(|network, _| network.targets[2].covariance = Some(Matrix3::identity() * 1e-6));
    assert!(said.contains("T02") && said.contains("control"), "{said}");
    let said = answer(|_, options| options.datum = NetworkDatum::Control);
    assert!(said.contains("no target and no station"), "{said}");
    let said = answer(|_, options| options.method = Method::JointIntegrated);
    assert!(said.contains("passive camera"), "{said}");
    let said = answer(|_, options| options.method = Method::TwoStepIndependent);
    assert!(said.contains("calibrate_two_networks"), "{said}");
    let said = message(calibrate_two_networks(&observed(), &observed(), &options()));
    assert!(said.contains("one network"), "{said}");
    let said = answer(|network, options| {
        options.method = Method::TwoStepDependent;
        network.sightings.iter_mut().for_each(|seen| seen.range_m = None);
    });
    assert!(said.contains("ranges"), "{said}");
    let said = answer(|network, options| {
        options.method = Method::Laboratory;
        network.stations[0].world_from_camera = None;
    });
    assert!(said.contains("`S00`") && said.contains("known distance"), "{said}");
}

#[test]
fn image_points_alone_are_a_start() {
    let start = SimulatedStart::Absent;
    let mut network = simulate_sightings(&small(), &SightingOptions { start, ..SightingOptions::default() }).unwrap();
    network.sightings.iter_mut().for_each(|seen| seen.range_m = None);
    let terms = TermSelection::List("xp yp c k1 k2 k3 p1 p2".split(' ').map(str::to_owned).collect());
    let sigma0 = calibrate(&network, &CalibrationOptions { terms, ..options() }).unwrap().sigma0.unwrap();
    assert!((0.9..1.1).contains(&sigma0), "{sigma0}");
}
