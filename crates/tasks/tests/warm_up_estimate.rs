//! Drift of a warming camera from surveys whose truth is known.

use std::path::{Path, PathBuf};

use error_models::ModelSet;
use pipeline::{Error, Plan, Silent, View, ViewData, process};
use range_io::calibration::Calibration;
use range_io::survey::{Level, ReferencePath, Survey};
use tasks::{ChangeOptions, DriftOptions, ReferenceUse, WarmUpRequest, WarmUpSummary, estimate_warm_up};

use crate::common::simulated;
use crate::warming::{POWER_ON_S, Warming, truth};

fn request(survey: PathBuf, out: &Path) -> WarmUpRequest {
    WarmUpRequest {
        survey,
        calibration: None,
        power_on_s: None,
        reference: ReferenceUse::Ignore,
        options: DriftOptions { tolerance_m: Some(1e-3), ..DriftOptions::default() },
        pixels: ChangeOptions::default(),
        out: out.to_owned(),
    }
}

fn estimated(warming: &Warming) -> Result<WarmUpSummary, Error> {
    let folder = tempfile::tempdir().unwrap();
    let survey = warming.write(folder.path());
    estimate_warm_up(&request(survey, &folder.path().join("out")), &Silent)
}

/// Each parameter within four of its deviations of the truth.
fn assert_true(summary: &WarmUpSummary) {
    println!("{summary}");
    let values = truth().parameter_values();
    assert_eq!(summary.parameters.len(), values.len(), "{summary}");
    for (parameter, truth) in summary.parameters.iter().zip(values) {
        assert!((parameter.value - truth).abs() < 4.0 * parameter.sigma, "{}: {truth}", parameter.name);
    }
}

#[test]
fn the_drift_of_ranges_goes_into_the_calibration() {
    let folder = tempfile::tempdir().unwrap();
    let survey = Warming::default().write(folder.path());
    let camera = Survey::read(&survey).unwrap().camera.nominal_camera().unwrap();
    let known = folder.path().join("known.ron");
    Calibration::from_models(&camera, &ModelSet::default(), None).unwrap().write(&known).unwrap();
    let out = folder.path().join("out");
    let summary =
        estimate_warm_up(&WarmUpRequest { calibration: Some(known), ..request(survey, &out) }, &Silent).unwrap();
    assert_true(&summary);
    assert!(summary.stable && summary.within_m.unwrap() < 2e-3);
    // 10 mm fall to 1 mm; frames of 0.4 mm tell the time to a few per cent.
    assert!((summary.stable_after_s - 600.0 * 10.0_f64.ln()).abs() < 150.0, "{}", summary.stable_after_s);
    assert!(summary.correlation[0][1].abs() < 1.0 && summary.doubts.is_empty());
    let drift = Calibration::read(&out).unwrap().warm_up.unwrap();
    assert_eq!(drift.model.parameter_names(), ["A1", "tau1"]);
    assert!((drift.model.transients[0].amplitude_m - summary.parameters[0].value).abs() < 1e-12);
    let covariance = drift.covariance().unwrap();
    assert!((covariance[(1, 1)].sqrt() / summary.parameters[1].sigma - 1.0).abs() < 1e-9);
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    for part in ["Change of range", "stable after", "How many exponentials", "tau1"] {
        assert!(report.contains(part), "{part}");
    }
}

#[test]
fn phases_that_wrap_tell_the_same_drift() {
    // Half of the wall's phases lie on either side of 2 π.
    let summary = estimated(&Warming { level: Level::Phase, range_m: 4.996 - 0.06, ..Warming::default() }).unwrap();
    assert_true(&summary);
}

#[test]
fn an_optical_reference_takes_the_place_of_the_scene_or_is_subtracted() {
    let path = ReferencePath { columns: [0, 3], rows: [0, 11], length_m: 0.4 };
    let folder = tempfile::tempdir().unwrap();
    let warming = Warming {
        reference_path: Some(path),
        change: |frame, [col, _], range_m| match col {
            0..=3 => 0.4,
            // The scene goes away, which no reference sees.
            _ => range_m + 2e-4 * frame as f64,
        },
        ..Warming::default()
    };
    let survey = warming.write(folder.path());
    let out = folder.path().join("out");
    let with = |reference| estimate_warm_up(&WarmUpRequest { reference, ..request(survey.clone(), &out) }, &Silent);
    assert_true(&with(ReferenceUse::Instead).unwrap());
    let error = with(ReferenceUse::Ignore).unwrap_err().to_string();
    assert!(error.contains("the drift goes on at its end"), "{error}");
    let error = with(ReferenceUse::Subtract).unwrap_err().to_string();
    assert!(error.contains("the drift goes on at its end"), "what is left is the scene: {error}");

    let folder = tempfile::tempdir().unwrap();
    let survey = Warming { change: |_, [col, _], range_m| if col < 4 { 0.4 } else { range_m }, ..warming };
    let survey = survey.write(folder.path());
    let subtracted = WarmUpRequest { reference: ReferenceUse::Subtract, ..request(survey, &out) };
    let summary = estimate_warm_up(&subtracted, &Silent).unwrap();
    assert!(summary.parameters.is_empty() && summary.stable, "the reference takes all of it: {summary}");
    assert!(summary.doubts.is_empty() && summary.notes[0].starts_with("No drift was found"));
}

#[test]
fn a_jump_leaves_its_reason_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let moved = |frame: usize, _: [usize; 2], range_m: f64| if frame < 200 { range_m } else { range_m + 0.005 };
    let survey = Warming { change: moved, ..Warming::default() }.write(folder.path());
    let out = folder.path().join("out");
    let error = estimate_warm_up(&request(survey, &out), &Silent).unwrap_err();
    assert!(matches!(error, Error::Refused { .. }) && error.to_string().contains("the ranges jump by"), "{error}");
    let names = std::fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let names: Vec<String> = names.filter(|name| !name.starts_with('.')).collect();
    assert_eq!(names, ["summary.json"], "a refusal leaves its reasons and nothing that could be taken for a result");
}

#[test]
fn surveys_that_do_not_serve_are_named() {
    for (warming, reason) in [
        (Warming { frames: 10, ..Warming::default() }, "too short"),
        (Warming { entry: |_, entry| entry.timestamp_s = None, ..Warming::default() }, "has no timestamp_s"),
        (
            Warming {
                entry: |index, entry| entry.station = if index < 5 { "A" } else { "B" }.to_owned(),
                ..Warming::default()
            },
            "frame 5 (0005.npz) is of station B",
        ),
        (
            Warming {
                entry: |index, entry| entry.integration_time_s = Some(1e-3 + 1e-3 * index as f64),
                ..Warming::default()
            },
            "another integration time",
        ),
        (
            Warming {
                entry: |index, entry| {
                    if index == 7 {
                        entry.timestamp_s = Some(5001.0);
                    }
                },
                ..Warming::default()
            },
            "timestamps do not ascend: sample 7",
        ),
    ] {
        let error = estimated(&Warming { frames: warming.frames.min(60), ..warming }).unwrap_err().to_string();
        assert!(error.contains(reason), "{error}");
    }
}

#[test]
fn a_calibration_needs_the_time_of_power_on() {
    let folder = tempfile::tempdir().unwrap();
    let survey = Warming { power_on_s: None, ..Warming::default() }.write(folder.path());
    let camera = Survey::read(&survey).unwrap().camera.nominal_camera().unwrap();
    let known = folder.path().join("known.ron");
    Calibration::from_models(&camera, &ModelSet::default(), None).unwrap().write(&known).unwrap();
    let request = WarmUpRequest { calibration: Some(known), ..request(survey, &folder.path().join("out")) };
    let error = estimate_warm_up(&request, &Silent).unwrap_err().to_string();
    assert!(error.contains("power_on_s"), "{error}");
    assert_true(
        &estimate_warm_up(&WarmUpRequest { power_on_s: Some(POWER_ON_S), ..request.clone() }, &Silent).unwrap(),
    );
    // Without a calibration times count from the first frame, a minute later.
    let summary = estimate_warm_up(&WarmUpRequest { calibration: None, ..request }, &Silent).unwrap();
    assert!(summary.power_on.starts_with("not known"));
    let amplitude = &summary.parameters[0];
    assert!((amplitude.value + 0.01 * (-60.0_f64 / 600.0).exp()).abs() < 4.0 * amplitude.sigma, "{summary}");
}

/// Mean error of the ranges over some frames, metre.
fn mean_error(views: &[View]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for view in views {
        let (ViewData::Range(frame), Some(truth)) = (&view.data, &view.truth) else { unreachable!("ranges and truth") };
        let flags = frame.flags.as_slice();
        for (index, (range, truth)) in frame.range.as_slice().iter().zip(truth.range.as_slice()).enumerate() {
            if flags[index].is_empty() {
                sum += f64::from(range - truth);
                count += 1.0;
            }
        }
    }
    sum / count
}

#[test]
fn what_was_estimated_takes_the_drift_off_the_ranges() {
    let folder = tempfile::tempdir().unwrap();
    let survey = simulated("warm_up", 1, folder.path());
    let out = folder.path().join("out");
    let known = Some(survey.join("truth/calibration.ron"));
    let request = WarmUpRequest { calibration: known, ..request(survey.clone(), &out) };
    let summary = estimate_warm_up(&request, &Silent).unwrap();
    println!("{summary}");
    for (parameter, truth) in summary.parameters.iter().zip([-0.03, 600.0]) {
        assert!((parameter.value - truth).abs() < 4.0 * parameter.sigma, "{}: {truth}", parameter.name);
    }
    let text = "(name: \"drift\", stages: [Demodulate(), Unwrap(), CorrectRange()])";
    let plan = Plan::from_ron(text, "drift.ron".as_ref()).unwrap();
    let outcome = process(&plan, &survey, Some(&out), &Silent).unwrap();
    // At the begin the camera was 27 mm off; a mean over 30 frames of 192 pixels of 4 mm is good to 0.05 mm, and the
    // drift is known by the same frames.
    for views in outcome.views.chunks(30) {
        assert!(mean_error(views).abs() < 2.5e-4, "{} m from {} s on", mean_error(views), views[0].timestamp_s);
    }
}
