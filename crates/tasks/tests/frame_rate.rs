//! A camera whose drift follows its frame rate (Fig. 6 of the chapter), from the simulation to corrected ranges.

use std::path::{Path, PathBuf};

use error_models::WarmUp;
use pipeline::{DriftTreatment, Plan, Processed, Silent, View, ViewData, ViewDrift, process};
use range_io::calibration::Calibration;
use range_io::survey::{FrameRate, Survey};
use tasks::{ChangeOptions, DriftOptions, ReferenceUse, WarmUpRequest, estimate_warm_up};
use tasks::{ExplainRequest, explain};

use crate::common::{simulated, simulated_from};

fn plan(treatment: DriftTreatment) -> Plan {
    let treatment = if treatment == DriftTreatment::Leave { "leave" } else { "apply" };
    let stages = format!("[Demodulate(), Unwrap(), CorrectRange(warm_up: {treatment})]");
    Plan::from_ron(&format!("(name: \"drift\", stages: {stages})"), Path::new("drift.ron")).unwrap()
}

fn drift(view: &View) -> &ViewDrift {
    view.correction.as_ref().unwrap().drift().unwrap()
}

/// Mean error of the ranges of some views, and the deviation that the noise of their pixels leaves of it, metre.
fn mean_error(views: &[View]) -> (f64, f64) {
    let (mut sum, mut variance, mut count) = (0.0, 0.0, 0.0);
    for view in views {
        let (ViewData::Range(frame), Some(truth)) = (&view.data, &view.truth) else { unreachable!("ranges and truth") };
        let known = frame.range.as_slice().iter().zip(truth.range.as_slice()).zip(frame.sigma.as_slice());
        for ((range, truth), sigma) in known.filter(|((range, _), _)| range.is_finite()) {
            sum += f64::from(range - truth);
            variance += f64::from(*sigma).powi(2);
            count += 1.0;
        }
    }
    (sum / count, f64::sqrt(variance) / count)
}

#[test]
fn what_was_estimated_makes_ranges_that_do_not_depend_on_the_phase() {
    let folder = tempfile::tempdir().unwrap();
    let survey = simulated("frame_rate", 1, folder.path());
    let out = folder.path().join("out");
    let request = WarmUpRequest {
        survey: survey.clone(),
        calibration: Some(survey.join("truth/calibration.ron")),
        power_on_s: None,
        reference: ReferenceUse::Ignore,
        options: DriftOptions { tolerance_m: Some(1e-3), ..DriftOptions::default() },
        pixels: ChangeOptions::default(),
        out: out.clone(),
    };
    let summary = estimate_warm_up(&request, &Silent).unwrap();
    println!("{summary}");
    let names: Vec<&str> = summary.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    assert_eq!(names, ["A1", "tau1", "cF", "tauF"]);
    for (parameter, truth) in summary.parameters.iter().zip([-0.01, 400.0, 0.15, 500.0]) {
        assert!((parameter.value - truth).abs() < 4.0 * parameter.sigma, "{}: {truth}", parameter.name);
    }
    let phases: Vec<(f64, usize)> = summary.phases.iter().map(|phase| (phase.since_s, phase.frames)).collect();
    assert_eq!(phases, [(0.0, 120), (2460.0, 600), (4860.0, 120)]);
    assert!(summary.rate_test.unwrap().taken && summary.stable && summary.stable_after_s > 4860.0);
    let words = summary.to_string();
    let phase = |from: &str| words.lines().find(|line| line.trim_start().starts_with(from)).map(str::trim_end);
    assert!(phase("0.0 ").is_some_and(|line| line.contains(" 0.050 ")), "{words}");
    assert!(phase("41.0 ").is_some_and(|line| line.contains(" 0.250 ")), "{words}");
    assert!(phase("81.0 ").is_some_and(|line| line.contains(" 0.050 ")), "{words}");
    assert!(words.contains("the drift follows the frame rate: p ="), "{words}");
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    for part in ["frame rate 0.05, 0.25, 0.05 Hz", "Whether it follows the frame rate", "cF", "f0 = 0.050 Hz"] {
        assert!(report.contains(part), "{part}");
    }
    let calibrated = Calibration::read(&out).unwrap().warm_up.unwrap();
    assert_eq!(calibrated.parameters()[2].unit, "m/Hz");

    let corrected = process(&plan(DriftTreatment::Apply), &survey, Some(&out), &Silent).unwrap();
    let left = process(&plan(DriftTreatment::Leave), &survey, Some(&out), &Silent).unwrap();
    let mut largest = [0.0_f64; 2];
    for (views, left) in corrected.views.chunks(60).zip(left.views.chunks(60)) {
        let ((error, sigma), (off, _)) = (mean_error(views), mean_error(left));
        let model = views.iter().map(|view| drift(view).sigma_m).fold(0.0, f64::max);
        let (rate, time_s) = (drift(&views[0]).frame_rate.unwrap(), views[0].timestamp_s);
        println!(
            "{time_s:.0} s, {:.2} Hz: off by {:.2} mm, corrected {:.3} ± {:.3} mm",
            rate.rate_hz,
            1e3 * off,
            1e3 * error,
            1e3 * sigma.hypot(model)
        );
        assert!(error.abs() < 4.0 * sigma.hypot(model), "{error} m from {time_s} s on");
        largest = [largest[0].max(off.abs()), largest[1].max(error.abs())];
    }
    assert!(largest[0] > 0.025 && largest[1] < 5e-4, "{largest:?}");
}

/// A survey of 28 frames: sixteen at the low rate and twelve at the high one.
fn short(folder: &Path) -> PathBuf {
    let text = std::fs::read_to_string(crate::common::fixtures().join("scenes/frame_rate.ron")).unwrap();
    let text = text.replace("frames_per_station: 840", "frames_per_station: 28");
    let text = text.replace("from_frame: 120", "from_frame: 16");
    let text = text.replace("warm_up: (", "warm_up: (time_span_s: (60.0, 7260.0),");
    let scene = folder.join("short.ron");
    std::fs::write(&scene, text).unwrap();
    simulated_from(&scene, 2, folder)
}

fn edit_survey(survey: &Path, change: impl FnOnce(&mut Survey)) {
    let mut read = Survey::read(survey).unwrap();
    read.truth = None;
    change(&mut read);
    read.write(survey.join(Survey::FILE_NAME)).unwrap();
}

fn edit_model(survey: &Path, change: impl FnOnce(&mut WarmUp)) {
    let file = survey.join("calibration.ron");
    let mut calibration = Calibration::read(&file).unwrap();
    change(&mut calibration.warm_up.as_mut().unwrap().model);
    calibration.write(&file).unwrap();
}

fn corrected(survey: &Path) -> pipeline::Result<Processed> {
    process(&plan(DriftTreatment::Apply), survey, None, &Silent)
}

#[test]
fn rates_that_a_survey_does_not_tell_are_named_with_a_way_out() {
    let folder = tempfile::tempdir().unwrap();
    let survey = short(folder.path());
    let whole = corrected(&survey).unwrap();
    let part = drift(&whole.views[27]).frame_rate.unwrap();
    // 44 s at 0.2 Hz more than the reference; intervals of decimal numbers are exact to rounding.
    assert!((part.part_m - 0.15 * 0.2 * (1.0 - f64::exp(-44.0 / 500.0))).abs() < 1e-12, "{part:?}");
    assert!((part.rate_hz - 0.25).abs() < 1e-12 && drift(&whole.views[0]).frame_rate.unwrap().part_m.abs() < 1e-15);
    let frames = Survey::read(&survey).unwrap().frames;
    let refused = |expected: &str, way_out: &str| {
        let message = corrected(&survey).unwrap_err().to_string();
        assert!(message.contains(expected) && message.contains(way_out), "{message}\nexpected {expected}");
        assert!(process(&plan(DriftTreatment::Leave), &survey, None, &Silent).is_ok());
    };
    let state =
        "state `frame_rates: [(since_s: .., rate_hz: ..)]` in survey.ron, from power-on on, or leave the drift in";
    edit_survey(&survey, |survey| survey.frames = frames[20..].to_vec());
    refused("8 frames tell no frame rate, 11 are needed", state);
    edit_survey(&survey, |survey| survey.frames = frames[16..].to_vec());
    refused("frame 0: the drift depends on the frame rate, which is not known from 60.0 s to 380.0 s", state);
    // With the rates stated the frames are as in the whole survey.
    let rate = |since_s: f64, rate_hz: f64| FrameRate { since_s, rate_hz };
    edit_survey(&survey, |survey| survey.frame_rates = vec![rate(0.0, 0.05), rate(380.0, 0.25)]);
    for (own, known) in corrected(&survey).unwrap().views.iter().zip(&whole.views[16..]) {
        assert!((drift(own).drift_m - drift(known).drift_m).abs() < 1e-12);
    }
    edit_survey(&survey, |survey| survey.frame_rates[0].since_s = 150.0);
    refused("not known from 0.0 s to 150.0 s", state);
    edit_survey(&survey, |survey| {
        survey.frame_rates.clear();
        survey.frames.clone_from(&frames);
        survey.frames[3].timestamp_s = None;
    });
    refused(
        "depends on the frame rate since power-on, and survey.ron has no `frames[3].timestamp_s`",
        "leave the drift",
    );
    edit_survey(&survey, |survey| {
        survey.frames.clone_from(&frames);
        survey.power_on_s = None;
    });
    refused("survey.ron has no `power_on_s`", "leave the drift");
    edit_survey(&survey, |survey| survey.power_on_s = Some(0.0));
    edit_model(&survey, |model| model.frame_rate.as_mut().unwrap().span_hz = Some([0.05, 0.1]));
    refused("the drift is not known at a frame rate of 0.25 Hz: it was fitted from 0.05 to 0.1 Hz", "leave the drift");
}

#[test]
fn the_part_of_the_frame_rate_stands_in_the_line_of_the_drift() {
    let folder = tempfile::tempdir().unwrap();
    let survey = short(folder.path());
    let request = ExplainRequest {
        survey,
        frame: "27".into(),
        pixel: [8, 6],
        plan: Some(plan(DriftTreatment::Apply)),
        calibration: None,
    };
    let found = explain(&request, &Silent).unwrap();
    println!("{found}");
    let line = found.stages.iter().find(|line| line.stage == "CorrectRange").unwrap();
    let part = line.parts.iter().find(|part| part.group == "warm-up").unwrap();
    assert!(part.what.contains("-2.53 mm of it by the frame rate of 0.25 Hz"), "{}", part.what);
}
