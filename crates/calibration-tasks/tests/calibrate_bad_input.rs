//! What is wrong with a calibration's survey is said with file, line and column, and nothing half-written is left.

use std::path::Path;

use calibration_tasks::{CalibrateMethod, CalibrateRequest, Method, NetworkDatum};

use crate::calibration_setup::{calibrate, changed, edit, keep_lines, terms};

/// What a calibration says of a changed fixture; it must fail and leave no output.
fn message(change: impl FnOnce(&Path), ask: impl FnOnce(&mut CalibrateRequest)) -> String {
    let folder = changed(change);
    let error = calibrate(folder.path(), ask).unwrap_err();
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().flatten().map(|entry| entry.file_name()).collect();
    assert_eq!(left, ["survey"], "a failed calibration leaves nothing but the survey: {error}");
    error.to_string()
}

fn as_it_is(_: &mut CalibrateRequest) {}

#[track_caller]
fn assert_says(message: &str, words: &[&str]) {
    for word in words {
        assert!(message.contains(word), "{message:?} does not say {word:?}");
    }
}

/// The fixture's first observation and its line.
const FIRST: &str = "F01,T022,";

#[test]
fn a_target_seen_once_is_named() {
    let said = message(
        |survey| {
            let file = survey.join("observations.csv");
            let text = std::fs::read_to_string(&file).unwrap();
            std::fs::write(&file, text + "F03,T999,80,70,2.1,0.05,0.05,0.01,500,0.004\n").unwrap();
        },
        as_it_is,
    );
    assert_says(&said, &["observations.csv:663:2: `target`", "`T999` is seen once, from station `F03`", "targets.csv"]);
}

#[test]
fn a_station_with_two_points_is_named() {
    let said = message(
        |survey| {
            let file = survey.join("observations.csv");
            let text = std::fs::read_to_string(&file).unwrap();
            let rows = "X01,T001,80,70,2.1,0.05,0.05,0.01,500,0.004\nX01,T002,90,70,2.1,0.05,0.05,0.01,500,0.004\n";
            std::fs::write(&file, text + rows).unwrap();
        },
        as_it_is,
    );
    assert_says(&said, &["observations.csv:663:1: `station`", "`X01` sees 2 targets only (T001, T002)", "three"]);
}

#[test]
fn duplicates_are_named_with_both_lines() {
    let twice = |survey: &Path| {
        let file = survey.join("observations.csv");
        let text = std::fs::read_to_string(&file).unwrap();
        let row = text.lines().nth(1).unwrap().to_owned();
        std::fs::write(&file, format!("{text}{row}\n")).unwrap();
    };
    assert_says(&message(twice, as_it_is), &["observations.csv:663:2", "`T022`", "`F01` twice", "line 2"]);
    let station = |survey: &Path| edit(&survey.join("stations.csv"), "\nF02,", "\nF01,");
    assert_says(&message(station, as_it_is), &["stations.csv:3:1: `station`", "given twice, first in line 2"]);
    let target = |survey: &Path| edit(&survey.join("targets.csv"), "\nT002,", "\nT001,");
    assert_says(&message(target, as_it_is), &["targets.csv:3:1: `target`", "given twice, first in line 2"]);
}

#[test]
fn standard_deviations_are_positive_and_there() {
    let zero = |survey: &Path| edit(&survey.join("observations.csv"), ",0.05,0.05,0.01,", ",0,0.05,0.01,");
    assert_says(&message(zero, as_it_is), &["observations.csv:2:6: `sigma_col`", "is 0, expected a positive"]);
    let negative = |survey: &Path| edit(&survey.join("observations.csv"), ",0.05,0.05,0.01,", ",0.05,0.05,-0.01,");
    assert_says(&message(negative, as_it_is), &["observations.csv:2:8: `sigma_range`", "is -0.01"]);
    let none = |survey: &Path| edit(&survey.join("observations.csv"), ",0.05,0.05,0.01,", ",,,0.01,");
    assert_says(&message(none, as_it_is), &["observations.csv:2:6: `sigma_col`", "is empty", "--sigma-pixel"]);
    let folder = changed(none);
    let summary = calibrate(folder.path(), |request| request.defaults.sigma_pixel = Some(0.05)).unwrap();
    assert!(summary.converged, "the option fills the gap");
}

#[test]
fn tables_that_are_none_are_refused() {
    let write =
        |text: &'static str| move |survey: &Path| std::fs::write(survey.join("observations.csv"), text).unwrap();
    assert_says(&message(write(""), as_it_is), &["observations.csv", "is empty", "station,target,col,row"]);
    let header = "station,target,col,row,range,sigma_col,sigma_row,sigma_range\n";
    assert_says(&message(write(header), as_it_is), &["observations.csv", "has no rows"]);
    let column = |survey: &Path| edit(&survey.join("observations.csv"), "sigma_range", "sigma_rho");
    assert_says(&message(column, as_it_is), &["observations.csv:1:8: `sigma_rho`", "is no column of this table"]);
    let nan =
        |survey: &Path| edit(&survey.join("observations.csv"), FIRST, "F01,T022,NaN,1,2,0.05,0.05,0.01,5,0.004\n#");
    assert_says(&message(nan, as_it_is), &["observations.csv:2:3: `col`", "is `NaN`, expected a finite number"]);
    let gone = |survey: &Path| std::fs::remove_file(survey.join("observations.csv")).unwrap();
    assert_says(&message(gone, as_it_is), &["observations.csv", "cannot open"]);
}

#[test]
fn integration_times_of_a_station_agree() {
    let other = |survey: &Path| {
        let file = survey.join("observations.csv");
        let text = std::fs::read_to_string(&file).unwrap();
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        lines[2] = lines[2].replace(",0.004", ",0.002");
        std::fs::write(&file, lines.join("\n")).unwrap();
    };
    let said = message(other, as_it_is);
    assert_says(&said, &["observations.csv:3:10: `integration_time_s`", "0.002", "`F01`", "0.004"]);
}

#[test]
fn distances_have_ends_that_exist_and_are_one_thing() {
    let end = |to: &'static str| move |survey: &Path| edit(&survey.join("distances.csv"), "T029", to);
    assert_says(&message(end("T777"), as_it_is), &["distances.csv:2:1: `from`", "`T777` is neither a station nor"]);
    let both = |survey: &Path| {
        for file in ["observations.csv", "distances.csv"] {
            let path = survey.join(file);
            let text = std::fs::read_to_string(&path).unwrap();
            std::fs::write(&path, text.replace("T029", "F01")).unwrap();
        }
    };
    assert_says(&message(both, as_it_is), &["distances.csv:2:1: `from`", "`F01` is both a station and a target"]);
    let zero = |survey: &Path| edit(&survey.join("distances.csv"), ",0.0005", ",0");
    assert_says(&message(zero, as_it_is), &["distances.csv:2:4: `sigma_distance`", "is 0"]);
}

#[test]
fn what_a_method_needs_is_named() {
    let untouched = |_: &Path| {};
    let method = |method| move |request: &mut CalibrateRequest| request.method = CalibrateMethod::Network(method);
    assert_says(&message(untouched, method(Method::JointIntegrated)), &["passive", "is missing"]);
    assert_says(&message(untouched, method(Method::TwoStepIndependent)), &["--lens-survey"]);
    let no_distances = |survey: &Path| std::fs::remove_file(survey.join("distances.csv")).unwrap();
    assert_says(&message(no_distances, method(Method::Laboratory)), &["distances.csv", "known distances"]);
    let control = |request: &mut CalibrateRequest| request.options.datum = NetworkDatum::Control;
    assert_says(&message(untouched, control), &["targets.csv", "has no standard deviations", "control"]);
    let planes = |request: &mut CalibrateRequest| request.method = CalibrateMethod::Planes;
    assert_says(&message(untouched, planes), &["planes.csv", "cannot open"]);
}

#[test]
fn names_that_nothing_has_are_refused() {
    let untouched = |_: &Path| {};
    let station = |request: &mut CalibrateRequest| request.options.without_ranges = vec!["Z9".to_owned()];
    assert_says(&message(untouched, station), &["--without-ranges", "`Z9`", "F01", "C06"]);
    let term = |request: &mut CalibrateRequest| request.options.terms = terms("xp q7");
    assert_says(&message(untouched, term), &["`q7`", "does not exist", "d0"]);
}

#[test]
fn one_frequency_and_the_format_of_the_calibration() {
    let two = |survey: &Path| edit(&survey.join("survey.ron"), "[20000000.0]", "[20000000.0, 30e6]");
    assert_says(&message(two, as_it_is), &["survey.ron", "modulation_hz", "2 frequencies, expected one"]);
    let narrow = |survey: &Path| {
        std::fs::copy(survey.join("truth/calibration.ron"), survey.join("calibration.ron")).unwrap();
        edit(&survey.join("calibration.ron"), "width: 176", "width: 175");
    };
    assert_says(&message(narrow, as_it_is), &["175 x 144", "176 x 144"]);
}

#[test]
fn a_passive_camera_is_checked_like_the_other() {
    let passive = |observations: &'static str, calibration: bool| {
        move |survey: &Path| {
            let folder = survey.join("passive");
            std::fs::create_dir(&folder).unwrap();
            std::fs::copy(survey.join("survey.ron"), folder.join("survey.ron")).unwrap();
            if calibration {
                std::fs::copy(survey.join("truth/calibration.ron"), folder.join("calibration.ron")).unwrap();
            }
            let header = "station,target,col,row,range,sigma_col,sigma_row,sigma_range\n";
            std::fs::write(folder.join("observations.csv"), format!("{header}{observations}")).unwrap();
        }
    };
    let said = message(passive("Q1,T001,5,5,,0.2,0.2,\n", true), as_it_is);
    assert_says(&said, &["passive/observations.csv:2:1: `station`", "`Q1` is no station of the range camera"]);
    let said = message(passive("F01,T001,5,5,2.0,0.2,0.2,0.1\n", true), as_it_is);
    assert_says(&said, &["passive/observations.csv:2:5: `range`", "a passive camera observes none"]);
    let said = message(passive("F01,T001,5,5,,0.2,0.2,\n", false), as_it_is);
    assert_says(&said, &["passive/calibration.ron", "is missing"]);
}

#[test]
fn an_older_result_survives_a_failed_calibration() {
    let folder = changed(|_| {});
    calibrate(folder.path(), as_it_is).unwrap();
    let before = std::fs::read_to_string(folder.path().join("out/summary.json")).unwrap();
    keep_lines(&folder.path().join("survey/observations.csv"), |line| line.starts_with("station"));
    calibrate(folder.path(), as_it_is).unwrap_err();
    assert_eq!(std::fs::read_to_string(folder.path().join("out/summary.json")).unwrap(), before);
}

#[test]
fn a_check_says_what_it_cannot_check() {
    let folder = tempfile::tempdir().unwrap();
    let survey = folder.path().join("survey");
    std::fs::create_dir(&survey).unwrap();
    let field = crate::common::fixtures().join("surveys/target_field");
    std::fs::copy(field.join("survey.ron"), survey.join("survey.ron")).unwrap();
    let request = |level, tolerance_m| calibration_tasks::CheckRequest {
        survey: survey.clone(),
        calibration: None,
        level,
        tolerance_m,
    };
    let said = |request: &calibration_tasks::CheckRequest| {
        calibration_tasks::check(request, &pipeline::Silent).unwrap_err().to_string()
    };
    assert_says(&said(&request(0.01, 0.001)), &["no calibration.ron beside", "--calibration"]);
    assert_says(&said(&request(1.5, 0.001)), &["--level", "1.5"]);
    assert_says(&said(&request(0.01, -1.0)), &["--tolerance", "-1"]);
    let nominal = range_io::survey::Survey::read(&survey).unwrap().camera.nominal_camera().unwrap();
    let lens = range_io::calibration::Calibration::from_models(&nominal, &error_models::ModelSet::default(), None);
    lens.unwrap().write(survey.join("calibration.ron")).unwrap();
    assert_says(&said(&request(0.01, 0.001)), &["no range terms"]);
}
