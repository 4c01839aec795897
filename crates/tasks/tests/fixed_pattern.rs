//! Fixed pattern estimated from simulated walls, against the truth, and where there is none.

use std::path::{Path, PathBuf};

use pipeline::Silent;
use range_io::calibration::Calibration;
use tasks::{FixedPatternRequest, PatternOptions, estimate_pattern};

use crate::common;
use crate::common::{simulated, simulated_with};

fn request(survey: &Path, out: PathBuf) -> FixedPatternRequest {
    FixedPatternRequest { survey: survey.to_owned(), calibration: None, options: PatternOptions::default(), out }
}

#[test]
fn the_pattern_of_the_simulation_is_found_and_kept() {
    let folder = tempfile::tempdir().unwrap();
    let survey = simulated("repeats", 1, folder.path());
    let out = folder.path().join("fpn");
    let summary = estimate_pattern(&request(&survey, out.clone()), &Silent).unwrap();
    println!("{summary}");
    assert!(summary.applied, "{}", summary.verdict);
    // What is taken off are the offsets; what comes in is how badly they are known.
    let expected =
        (summary.rms_without_m.powi(2) - summary.offset_rms_m.powi(2) + summary.deviation_rms_m.powi(2)).sqrt();
    // Three and a half thousand pixels know a root mean square to 1 %.
    assert!((summary.rms_with_m / expected - 1.0).abs() < 0.05, "{} m, {expected} m expected", summary.rms_with_m);
    let truth = Calibration::read(survey.join("truth/calibration.ron")).unwrap().fixed_pattern.unwrap();
    let found = Calibration::read(&out).unwrap().fixed_pattern.unwrap();
    let pairs =
        || found.offset_m.iter().zip(&truth.offset_m).zip(&found.sigma_m).filter(|(_, sigma)| sigma.is_finite());
    let count = pairs().count() as f64;
    let error = |((found, truth), _): ((&f32, &f32), &f32)| f64::from(found - truth).powi(2);
    let rms = (pairs().map(error).sum::<f64>() / count).sqrt();
    println!("{count} pixels, {:.3} mm off the truth, {:.3} mm expected", 1e3 * rms, 1e3 * summary.deviation_rms_m);
    // The deviation knows of noise and of what walls disagree in, not of what all walls share.
    assert!(rms < 1.5 * summary.deviation_rms_m && rms < 0.002, "{rms}");
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.contains("Does it raise the precision?"));
}

#[test]
fn a_camera_without_a_pattern_gets_none() {
    let folder = tempfile::tempdir().unwrap();
    let survey = simulated_with("repeats", ["fixed_pattern: (sigma_m: 0.004, seed: 7),", ""], folder.path());
    let out = folder.path().join("fpn");
    let summary = estimate_pattern(&request(&survey, out.clone()), &Silent).unwrap();
    println!("{summary}");
    assert!(!summary.applied, "{}", summary.verdict);
    assert!(Calibration::read(&out).unwrap().fixed_pattern.is_none());
}

#[test]
fn a_single_frame_is_refused_with_its_reason() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(common::fixtures().join("scenes/repeats.ron")).unwrap();
    let text = text.replace("frames_per_station: 6", "frames_per_station: 1");
    let first = text.find("        (name: \"W1\"").unwrap();
    let last = text.find("    ],\n    errors").unwrap();
    let scene = folder.path().join("one.ron");
    std::fs::write(&scene, format!("{}{}", &text[..first], &text[last..])).unwrap();
    let survey = common::simulated_from(&scene, 1, folder.path());
    let error = estimate_pattern(&request(&survey, folder.path().join("fpn")), &Silent).unwrap_err();
    assert!(matches!(error, pipeline::Error::Refused { .. }), "{error}");
    assert!(error.to_string().contains("has 1 frames, 2 are needed"), "{error}");
}
