//! Scattering estimated from a scene with and without a bright board, against the truth and on another scene.

use std::path::{Path, PathBuf};

use pipeline::{Plan, Silent, process};
use range_io::calibration::Calibration;
use tasks::{EstimationOptions, ScatteringRequest, estimate_scattering};

use crate::common::simulated;

fn request(with_object: &Path, without_object: &Path, out: PathBuf) -> ScatteringRequest {
    ScatteringRequest {
        with_object: with_object.to_owned(),
        without_object: without_object.to_owned(),
        calibration: None,
        options: EstimationOptions::default(),
        out,
    }
}

/// Median range error of the small room after its range terms were taken off, metre.
fn room_error(survey: &Path, calibration: Option<&Path>, deconvolve: &str) -> f64 {
    let stages =
        format!("[Demodulate(low_amplitude: 20), Average(), {deconvolve} Unwrap(maximum_range_m: 12), CorrectRange()]");
    let plan = Plan::from_ron(&format!("(name: \"room\", stages: {stages})"), "room.ron".as_ref()).unwrap();
    let outcome = process(&plan, survey, calibration, &Silent).unwrap();
    outcome.stages.last().unwrap().truth.as_ref().unwrap().range_error_median_m
}

#[test]
fn scattering_is_found_and_taken_off_another_scene() {
    let folder = tempfile::tempdir().unwrap();
    let with_object = simulated("foreground", 1, folder.path());
    let without_object = simulated("background", 2, folder.path());
    let out = folder.path().join("scattering");
    let summary = estimate_scattering(&request(&with_object, &without_object, out.clone()), &Silent).unwrap();
    println!("{summary}");
    assert!(summary.determined, "{}", summary.verdict);
    let truth = [("weight 1", 0.05), ("sigma_px 1", 3.0), ("weight 2", 0.16), ("sigma_px 2", 27.0)];
    for (name, truth) in truth {
        let found = summary.parameters.iter().find(|parameter| parameter.name == name).unwrap();
        // Range terms that depend on the amplitude are no convolution, and four frames an average: a tenth.
        assert!((found.value / truth - 1.0).abs() < 0.1, "{name}: {} instead of {truth}", found.value);
        assert!(found.sigma > 0.0 && found.sigma < 0.1 * truth, "{name}: sigma {}", found.sigma);
    }
    let (before, after) = (summary.shift_median_m.unwrap(), summary.shift_restored_median_m.unwrap());
    assert!(after < 0.1 * before, "the background moves by {after} m instead of {before} m");

    let calibration = Calibration::read(&out).unwrap();
    assert_eq!(calibration.scattering_parameters.len(), 4);
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.contains("As observed") && report.contains("Restored"));

    let room = simulated("room_small", 3, folder.path());
    let raw = room_error(&room, None, "");
    let known = room_error(&room, None, "Deconvolve(),");
    let estimated = room_error(&room, Some(&out), "Deconvolve(),");
    println!("median error of the room: {raw} m raw, {known} m with the true scattering, {estimated} m as estimated");
    assert!(estimated < known + 0.1 * (raw - known), "{estimated}");
}

#[test]
fn captures_without_an_object_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [one, other] = [1, 2].map(|seed| simulated("background", seed, folder.path()));
    let out = folder.path().join("scattering");
    let error = estimate_scattering(&request(&one, &other, out.clone()), &Silent).unwrap_err();
    assert!(matches!(error, pipeline::Error::Refused { .. }), "{error}");
    assert!(error.to_string().contains("no object is brighter than the noise"), "{error}");
    let names = std::fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let names: Vec<String> = names.filter(|name| !name.starts_with('.')).collect();
    assert_eq!(names, ["summary.json"], "a refusal leaves its reasons and nothing that could be taken for a result");
}

#[test]
fn surveys_that_do_not_belong_together_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let with_object = simulated("foreground", 1, folder.path());
    let room = simulated("corner_multipath", 1, folder.path());
    let error = estimate_scattering(&request(&with_object, &room, folder.path().join("out")), &Silent).unwrap_err();
    assert!(error.to_string().contains("no station `S1`") && error.to_string().ends_with("S0"), "{error}");
    assert!(!folder.path().join("out").exists());
}
