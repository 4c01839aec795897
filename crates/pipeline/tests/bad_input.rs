//! What is wrong is said with file and field, and nothing half-written is left.

use std::path::{Path, PathBuf};

use pipeline::stages::Line;
use pipeline::survey::{Purpose, open};
use pipeline::{Error, Failure, Plan, RunRequest, Silent, Stage, View, ViewData};
use range_image::{RangeFrame, Raster};
use range_io::npz::NpzWriter;

use crate::common::{fixtures, request};

const SURVEY: &str = r#"(
    camera: (
        width: 4, height: 3, pixel_pitch_mm: (0.04, 0.04),
        principal_distance_mm: 8.0, principal_point_mm: (0.0, 0.0),
        modulation_hz: [30e6], phase_steps: 4,
    ),
    level: samples,
    frames: [(file: "0.npz", station: "S0")],
)"#;

/// A survey of one frame of 4 x 3 pixels; returns the folder and what a run into `out` says.
fn attempt(survey: &str, samples: &[f32], shape: &[usize], stages: &str) -> (tempfile::TempDir, Result<(), String>) {
    let folder = tempfile::tempdir().unwrap();
    let root = &folder.path().join("survey");
    std::fs::create_dir(root).unwrap();
    std::fs::write(root.join("survey.ron"), survey).unwrap();
    let mut writer = NpzWriter::create(root.join("0.npz")).unwrap();
    writer.add("samples", shape, samples).unwrap();
    writer.commit().unwrap();
    let outcome = run_stages(root, stages);
    (folder, outcome)
}

fn run_stages(survey: &Path, stages: &str) -> Result<(), String> {
    let plan = Plan::from_ron(&format!("(name: \"x\", stages: [{stages}])"), Path::new("x.ron"));
    let folder = survey.parent().unwrap();
    let out = folder.join("out");
    let request = RunRequest {
        plan: plan.map_err(|error| error.to_string())?,
        plan_path: PathBuf::from("x.ron"),
        survey: Some(survey.to_owned()),
        calibration: None,
        out: out.clone(),
    };
    let result = pipeline::run(&request, &Silent).map(|_| ());
    if let Err(error) = &result {
        let refused = error.failure() == Failure::Refused;
        assert_eq!(out.exists(), refused, "a run that fails leaves no output folder, and a refusal its reason");
        assert!(!refused || std::fs::read_dir(&out).unwrap().count() == 2, "summary.json and .complete");
        let stray = std::fs::read_dir(folder).unwrap().flatten();
        let stray = stray.filter(|entry| entry.file_name().to_string_lossy().contains("out."));
        assert_eq!(stray.count(), 0, "and nothing half-written beside it");
    }
    result.map_err(|error| error.to_string())
}

fn ramp(count: usize) -> Vec<f32> {
    (0..count).map(|k| 100.0 + (k % 7) as f32).collect()
}

fn assert_says(outcome: &Result<(), String>, words: &[&str]) {
    let message = outcome.as_ref().unwrap_err();
    for word in words {
        assert!(message.contains(word), "{message:?} does not name {word:?}");
    }
}

#[test]
fn a_sound_survey_passes() {
    let (_folder, outcome) = attempt(SURVEY, &ramp(48), &[1, 4, 3, 4], "Demodulate(), PointCloudless()");
    assert_says(&outcome, &["x.ron", "PointCloudless"]);
    let (_folder, outcome) = attempt(SURVEY, &ramp(48), &[1, 4, 3, 4], "Demodulate(), Unwrap(), PointCloud()");
    outcome.unwrap();
}

#[test]
fn wrong_shapes_name_the_array() {
    let (_folder, outcome) = attempt(SURVEY, &ramp(24), &[1, 4, 3, 2], "Demodulate()");
    assert_says(&outcome, &["0.npz", "samples", "W = 4"]);
}

#[test]
fn a_truncated_archive_names_the_file() {
    let (folder, outcome) = attempt(SURVEY, &ramp(48), &[1, 4, 3, 4], "Demodulate()");
    outcome.unwrap();
    let file = folder.path().join("survey/0.npz");
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
    std::fs::remove_dir_all(folder.path().join("out")).unwrap();
    assert_says(&run_stages(&folder.path().join("survey"), "Demodulate()"), &["0.npz"]);
}

/// As it would be if frames came one by one, however many of them go through the stages at the same time.
#[test]
fn of_several_errors_that_of_the_first_frame_is_told() {
    let (folder, outcome) = attempt(SURVEY, &ramp(48), &[1, 4, 3, 4], "Demodulate()");
    outcome.unwrap();
    let survey = open(&folder.path().join("survey"), (None, String::new()), Purpose::Camera).unwrap();
    // Read one by one, as a plan would refuse the order that the test needs.
    let stage = |text: &&str| {
        Plan::from_ron(&format!("(name: \"x\", stages: [{text}])"), Path::new("x.ron")).unwrap().stages.remove(0)
    };
    let through = |stages: &[&str], views: Vec<pipeline::Result<View>>| {
        let stages: Vec<Stage> = stages.iter().map(stage).collect();
        Line::new(&stages, &survey).unwrap().apply(views, &mut ())
    };
    let phases = || through(&["Demodulate()"], vec![survey.view(0)]).map(|mut views| views.remove(0));
    // Its image has another size than the camera, which only the second of the stages below minds.
    let mut ranges = through(&["Demodulate()", "Unwrap()"], vec![survey.view(0)]).unwrap().remove(0);
    ranges.data = ViewData::Range(RangeFrame::from_range(Raster::filled(2, 2, 1.0)));
    let unread = || Err(Error::Camera("it cannot be read".to_owned()));
    let told =
        |views: Vec<pipeline::Result<View>>| Err(through(&["Flag()", "PointCloud()"], views).unwrap_err().to_string());
    assert_says(&told(vec![Ok(ranges), phases(), unread()]), &["PointCloud"]);
    assert_says(&told(vec![phases(), unread()]), &["Flag"]);
    assert_says(&told(vec![unread(), phases()]), &["cannot be read"]);
}

#[test]
fn samples_without_any_value_are_refused_and_single_gaps_are_flagged() {
    let (_folder, outcome) = attempt(SURVEY, &[f32::NAN; 48], &[1, 4, 3, 4], "Demodulate()");
    assert_says(&outcome, &["0.npz", "samples", "finite"]);
    let mut samples = ramp(48);
    samples[5] = f32::INFINITY;
    let (_folder, outcome) = attempt(SURVEY, &samples, &[1, 4, 3, 4], "Demodulate(), Unwrap(), PointCloud()");
    outcome.unwrap();
}

#[test]
fn a_missing_file_is_named() {
    let (folder, outcome) = attempt(SURVEY, &ramp(48), &[1, 4, 3, 4], "Demodulate()");
    outcome.unwrap();
    std::fs::remove_file(folder.path().join("survey/0.npz")).unwrap();
    std::fs::remove_dir_all(folder.path().join("out")).unwrap();
    assert_says(&run_stages(&folder.path().join("survey"), "Demodulate()"), &["0.npz"]);
}

#[test]
fn unknown_fields_and_no_frames_are_refused() {
    let unknown = SURVEY.replace("phase_steps: 4", "phase_stepz: 4");
    let (_folder, outcome) = attempt(&unknown, &ramp(48), &[1, 4, 3, 4], "Demodulate()");
    assert_says(&outcome, &["survey.ron", "phase_stepz"]);
    let empty = SURVEY.replace(r#"[(file: "0.npz", station: "S0")]"#, "[]");
    let (_folder, outcome) = attempt(&empty, &ramp(48), &[1, 4, 3, 4], "Demodulate()");
    assert_says(&outcome, &["survey.ron", "frames"]);
}

#[test]
fn one_pixel_is_a_frame_like_others() {
    let survey = SURVEY.replace("width: 4, height: 3", "width: 1, height: 1");
    let (_folder, outcome) = attempt(&survey, &ramp(4), &[1, 4, 1, 1], "Demodulate(), Unwrap(), PointCloud(), Flag()");
    outcome.unwrap();
}

#[test]
fn a_singular_calibration_is_refused_by_name() {
    let (folder, outcome) = attempt(SURVEY, &ramp(48), &[1, 4, 3, 4], "Demodulate()");
    outcome.unwrap();
    std::fs::remove_dir_all(folder.path().join("out")).unwrap();
    let calibration = r#"(
        format_version: 1, camera: (width: 4, height: 3, pixel_pitch_mm: (0.04, 0.04)),
        parameters: [
            (name: "xp", value: 0.0, sigma: 0.0, unit: "mm", status: Held),
            (name: "yp", value: 0.0, sigma: 0.0, unit: "mm", status: Held),
            (name: "c", value: 0.0, sigma: 0.0, unit: "mm", status: Held),
        ],
    )"#;
    std::fs::write(folder.path().join("survey/calibration.ron"), calibration).unwrap();
    assert_says(&run_stages(&folder.path().join("survey"), "Demodulate()"), &["calibration.ron", "c"]);
}

#[test]
fn stages_that_the_level_rules_out_are_refused_by_name() {
    let survey = SURVEY.replace("level: samples", "level: range");
    let (_folder, outcome) = attempt(&survey, &ramp(48), &[1, 4, 3, 4], "Demodulate()");
    assert_says(&outcome, &["Demodulate", "samples", "range"]);
}

#[test]
fn stages_in_the_wrong_order_or_without_their_input_are_refused() {
    let (_folder, outcome) = attempt(SURVEY, &ramp(48), &[1, 4, 3, 4], "Unwrap(), Demodulate()");
    assert_says(&outcome, &["Demodulate", "Unwrap"]);
    let (_folder, outcome) = attempt(SURVEY, &ramp(48), &[1, 4, 3, 4], "Demodulate(), Flag()");
    assert_says(&outcome, &["Flag", "Unwrap"]);
    let (_folder, outcome) = attempt(SURVEY, &ramp(48), &[1, 4, 3, 4], "Demodulate(), Deconvolve()");
    assert_says(&outcome, &["Deconvolve", "scattering"]);
}

#[test]
fn an_older_result_survives_a_run_that_fails() {
    let (folder, outcome) = attempt(SURVEY, &ramp(48), &[1, 4, 3, 4], "Demodulate(), Unwrap(), PointCloud()");
    outcome.unwrap();
    let summary = folder.path().join("out/summary.json");
    let before = std::fs::read(&summary).unwrap();
    std::fs::write(folder.path().join("survey/0.npz"), b"not an archive").unwrap();
    let mut request = request("room_small", &folder.path().join("out"));
    request.survey = Some(folder.path().join("survey"));
    assert!(pipeline::run(&request, &Silent).is_err());
    assert_eq!(std::fs::read(&summary).unwrap(), before);
}

#[test]
fn the_pipelines_of_the_repository_can_be_read() {
    for entry in std::fs::read_dir(fixtures().join("pipelines")).unwrap() {
        let path = entry.unwrap().path();
        assert!(!Plan::read(&path).unwrap().stages.is_empty(), "{}", path.display());
    }
}
