//! Calibration from surfaces and its check, from files: surveys that cannot serve are refused by name.

use std::path::{Path, PathBuf};

use calibration_tasks::pipeline::{Error, Silent, SimulateSource, simulate};
use calibration_tasks::{
    CalibrateMethod, CalibrateRequest, CalibrationOptions, CertificateRequest, CheckRequest, OffsetModel,
    TableDefaults, TermSelection, calibrate, check,
};
use commands::plan::DriftTreatment;

/// A survey of the small room with something changed in the scene's text.
fn survey(folder: &Path, name: &str, change: impl Fn(&str) -> String) -> PathBuf {
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/scenes/room_small.ron");
    let scene = folder.join(format!("{name}.ron"));
    std::fs::write(&scene, change(&std::fs::read_to_string(fixture).unwrap())).unwrap();
    let source = SimulateSource {
        scene: scene.display().to_string(),
        seed: 3,
        approximate_position_sigma_m: 0.05,
        approximate_attitude_sigma_deg: 2.0,
        gross_error_share: 0.0,
    };
    let survey = folder.join(name);
    simulate(&source, Path::new(""), &survey, &Silent).unwrap();
    survey
}

/// What `calibrate --method surfaces` and `check` say of a survey that cannot serve.
fn refused(survey: &Path) -> [String; 2] {
    let request = CalibrateRequest {
        survey: survey.to_owned(),
        lens_survey: None,
        calibration: None,
        method: CalibrateMethod::Surfaces,
        options: CalibrationOptions { terms: TermSelection::Auto, ..CalibrationOptions::default() },
        offset: OffsetModel::Constant,
        warm_up: DriftTreatment::Apply,
        defaults: TableDefaults::default(),
        certificate: CertificateRequest::default(),
        out: survey.with_extension("out"),
    };
    let checked = CheckRequest { survey: survey.to_owned(), calibration: None, level: 0.05, tolerance_m: 1e-3 };
    let errors: [Error; 2] = [calibrate(&request, &Silent).unwrap_err(), check(&checked, &Silent).unwrap_err()];
    assert!(!request.out.join("calibration.ron").exists());
    let errors = errors.map(|error| error.to_string());
    println!("{errors:#?}");
    errors
}

#[test]
fn one_station_and_two_frequencies_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let one = survey(folder.path(), "one", |scene| {
        let is_other = |line: &str| (1..8).any(|k| line.contains(&format!("(name: \"S{k}\", position_m")));
        scene.lines().filter(|line| !is_other(line)).collect::<Vec<&str>>().join("\n")
    });
    assert!(refused(&one).iter().all(|error| error.contains("one station, `S0`")));
    let two = survey(folder.path(), "two", |scene| {
        let (first, rest) = scene.split_once("range: [").unwrap();
        let (entry, last) = rest.split_once("],\n        scattering").unwrap();
        let other = entry.replace("4.996540966666667", "3.331027311111111");
        let both = format!("{first}range: [{entry}, {other}],\n        scattering{last}");
        both.replace("modulation_hz: [30.0e6]", "modulation_hz: [30.0e6, 45.0e6]")
    });
    assert!(refused(&two).iter().all(|error| error.contains("frequenc")));
}
