//! Range terms estimated together with the poses from surfaces that several stations see.

use crate::round;
use multiview_registration::Datum;
use range_calibration::{
    Error, SurfaceCalibration, SurfaceCalibrationOptions, SurfaceCapture, SurfaceTerm, calibrate_surfaces,
};

fn calibrate(
    truth: &[(&str, f64)],
    names: &[&str],
    stations: usize,
    seed: u64,
) -> Result<SurfaceCalibration, range_calibration::Error> {
    let poses = round::poses(stations);
    let frames = round::frames(&poses, &round::model(truth), seed);
    let captures: Vec<SurfaceCapture<'_>> = frames
        .iter()
        .zip(&poses)
        .map(|(frame, pose)| SurfaceCapture { name: "station", frame, world_from_camera: Some(*pose) })
        .collect();
    let terms = names.iter().map(|name| SurfaceTerm::free(name)).collect();
    let options = SurfaceCalibrationOptions { terms, ..SurfaceCalibrationOptions::default() };
    let known = round::model(&[]);
    calibrate_surfaces(&captures, &round::camera(), &known, Datum::Station(0), &options, &|_, _| {})
}

/// Largest error of a position relative to the first station, metre.
fn position_error(registration: &multiview_registration::StationRegistration, stations: usize) -> f64 {
    let truth = round::poses(stations);
    let relative = |poses: &[nalgebra::Isometry3<f64>], k: usize| poses[0].inverse() * poses[k];
    (1..stations)
        .map(|k| {
            let difference = relative(&registration.world_from_station, k).translation.vector
                - relative(&truth, k).translation.vector;
            difference.norm()
        })
        .fold(0.0, f64::max)
}

#[test]
fn an_offset_and_a_wave_are_found_with_the_poses() {
    let truth = [("d0", 0.024), ("d4", 0.006), ("d5", -0.005)];
    let result = calibrate(&truth, &["d0", "d4", "d5"], 8, 1).unwrap();
    for (parameter, (name, value)) in result.parameters().unwrap().iter().filter(|p| p.sigma > 0.0).zip(truth) {
        println!("{name}: {:.5} +- {:.5}, truth {value}", parameter.value, parameter.sigma);
        assert_eq!(parameter.name, name);
        // Four deviations: one run in ten thousand of three values.
        assert!((parameter.value - value).abs() < 4.0 * parameter.sigma, "{name}");
        // Honest, and useful: a tenth of what is there.
        assert!(parameter.sigma < 1e-3, "{name}");
    }
    let [before, after] = result.surface_rms_m();
    let [off, close] = [&result.before, &result.after].map(|registration| position_error(registration, 8));
    println!("surfaces {before:.5} to {after:.5} m, positions {off:.5} to {close:.5} m");
    // An offset of 24 mm stretches the room: double walls and stations too far apart.
    assert!(after < 0.7 * before && close < 0.25 * off);
}

#[test]
fn what_is_not_there_is_not_found() {
    let result = calibrate(&[], &["d0", "d4", "d5"], 6, 2).unwrap();
    // Three values beyond 4 deviations by chance: one run in five thousand.
    assert!(result.shared().significance.iter().all(|significance| significance.abs() < 4.0));
    assert!(result.model().parameter_values().iter().all(|value| value.abs() < 2e-3));
}

#[test]
fn one_wall_names_what_it_leaves_open() {
    // Two stations beside each other that see one wall of the room.
    let poses = [
        round::room::look_at([-0.3, 0.2, 1.9], [-0.3, -2.0, 1.9]),
        round::room::look_at([0.2, 0.2, 1.9], [0.2, -2.0, 1.9]),
    ];
    let mut answered = 0;
    for seed in 1..=5 {
        let frames = round::frames(&poses, &round::model(&[("d0", 0.024)]), seed);
        let captures: Vec<SurfaceCapture<'_>> = frames
            .iter()
            .zip(&poses)
            .map(|(frame, pose)| SurfaceCapture { name: "wall", frame, world_from_camera: Some(*pose) })
            .collect();
        let options = SurfaceCalibrationOptions { largest_sigma_m: 1e-3, ..SurfaceCalibrationOptions::default() };
        let known = round::model(&[]);
        let found = calibrate_surfaces(&captures, &round::camera(), &known, Datum::Station(0), &options, &|_, _| {});
        let found = match found {
            Err(Error::SurfacesNotDetermined { term, .. }) if term == "d0" => continue,
            found => found.unwrap(),
        };
        answered += 1;
        // The bulge of a wall tells an offset if walls are plane, but nothing holds the stations along it.
        let open = &found.after.undetermined[0];
        assert!(open.station == 1 && open.motions[0].axis.x.abs() > 0.99, "{open:?}");
        let (d0, sigma) = (found.shared().values[0], found.shared().covariance[0][0].sqrt());
        assert!((d0 - 0.024).abs() < 4.0 * sigma && sigma < 1e-3, "{d0} +- {sigma}");
    }
    assert!(answered >= 3, "{answered}");
}

#[test]
fn terms_are_known_by_their_names() {
    assert!(matches!(calibrate(&[], &["d9"], 2, 4), Err(Error::UnknownName { .. })));
    assert!(matches!(calibrate(&[], &["d0", "d0"], 2, 4), Err(Error::DuplicateName { .. })));
    assert!(matches!(calibrate(&[], &[], 2, 4), Err(Error::NothingToEstimate)));
}
