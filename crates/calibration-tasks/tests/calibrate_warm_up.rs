//! Calibration from ranges of a camera that was still warming up, with its drift known from before.

use std::path::Path;

use calibration_tasks::CalibrationSummary;
use error_models::{ModelSet, RangeErrorModel, RangeTerms, Transient, WarmUp};
use pipeline::{DriftTreatment, Plan, Silent, process};
use range_io::calibration::{CalibratedDrift, Calibration};

use crate::calibrate_planes::{camera, planes, truth, write_drifting_survey};
use crate::calibration_setup::{calibrate, changed, edit, terms};

fn warm_up() -> WarmUp {
    WarmUp { transients: vec![Transient { amplitude_m: -0.03, time_constant_s: 900.0 }], ..WarmUp::default() }
}

fn write_survey(folder: &Path) {
    write_drifting_survey(&folder.join("survey"), |time_s| warm_up().value(Some(time_s), None).unwrap());
}

/// A calibration beside the survey that knows the drift, and these terms.
fn write_start(folder: &Path, models: &ModelSet) {
    let mut start = Calibration::from_models(&camera(), models, None).unwrap();
    start.warm_up = Some(CalibratedDrift { model: warm_up(), deviations: vec![1e-4, 10.0], correlation: None });
    start.write(folder.join("survey/calibration.ron")).unwrap();
}

fn require_truth(summary: &CalibrationSummary, skipped: usize) {
    for (name, value) in RangeTerms::NAMES.iter().zip(truth().terms.to_array()).skip(skipped) {
        let found = summary.parameters.get(name).unwrap();
        // The drift given is the true one: nothing comes on top of the deviation that the scatter shows.
        let deviation = (found.value - value) / found.sigma_posterior;
        assert!(deviation.abs() < 4.0, "{name}: {deviation:.1} sigmas off");
    }
    assert!((summary.groups[0].rms - 0.003).abs() < 2e-4, "{:?}", summary.groups);
}

#[test]
fn a_known_drift_is_taken_off_ranges_to_known_planes() {
    let folder = tempfile::tempdir().unwrap();
    write_survey(folder.path());
    write_start(folder.path(), &ModelSet::default());
    let summary = calibrate(folder.path(), planes).unwrap();
    println!("{summary}");
    require_truth(&summary, 0);
    assert_eq!(summary.drifts.len(), 7);
    // The first frame came a minute after power-on.
    assert!((summary.drifts[0].drift_m + 0.03 * (-60.0_f64 / 900.0).exp()).abs() < 1e-12, "{:?}", summary.drifts);
    let report = std::fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(report.contains("the drift of the warming camera is taken off the ranges: -28.07 to"), "in the lead");
    // What is written corrects the same frames.
    let written = Calibration::read(folder.path().join("out")).unwrap();
    assert_eq!(written.warm_up.unwrap().model, warm_up());
    let plan = Plan::from_ron("(name: \"x\", stages: [CorrectRange(), PointCloud()])", "x.ron".as_ref()).unwrap();
    let corrected = process(&plan, &folder.path().join("survey"), Some(&folder.path().join("out")), &Silent).unwrap();
    for (view, drift) in corrected.views.iter().zip(&summary.drifts) {
        assert_eq!(view.correction.as_ref().unwrap().drift(), Some(drift), "the same drift");
    }

    std::fs::remove_dir_all(folder.path().join("out")).unwrap();
    let left = calibrate(folder.path(), |request| {
        planes(request);
        request.warm_up = DriftTreatment::Leave;
    });
    let left = left.unwrap();
    assert!(left.drifts.is_empty() && (left.parameters.get("d0").unwrap().value - truth().terms.d0).abs() > 5e-3);
}

#[test]
fn a_known_drift_is_taken_off_ranges_to_planes_that_are_found() {
    let folder = tempfile::tempdir().unwrap();
    write_survey(folder.path());
    let table = folder.path().join("survey/planes.csv");
    let text = std::fs::read_to_string(&table).unwrap().replace(",0,0,2,0", ",,,,");
    std::fs::write(&table, text).unwrap();
    // The offset and the distance of an unknown plane are nearly one thing: the offset is held.
    let offset = RangeErrorModel { terms: RangeTerms { d0: 0.024, ..RangeTerms::default() }, ..truth() };
    write_start(folder.path(), &ModelSet { entries: vec![(0.002, vec![offset])] });
    let summary = calibrate(folder.path(), |request| {
        planes(request);
        request.options.terms = terms("d2 d3 d4 d5 d6 d7 e1 e2");
    });
    require_truth(&summary.unwrap(), 1);
}

#[test]
fn what_the_drift_needs_and_the_survey_lacks_is_named() {
    let folder = tempfile::tempdir().unwrap();
    write_survey(folder.path());
    write_start(folder.path(), &ModelSet::default());
    let file = folder.path().join("survey/survey.ron");
    let refused = || calibrate(folder.path(), planes).unwrap_err().to_string();
    edit(&file, "timestamp_s: 660.0", "");
    let message = refused();
    assert!(message.contains("station S2, frame 2") && message.contains("`frames[2].timestamp_s`"), "{message}");
    edit(&file, "power_on_s: 0.0,", "");
    let message = refused();
    assert!(message.contains("station S0, frame 0") && message.contains("no `power_on_s`"), "{message}");
    assert!(message.contains("`calibrate --warm-up leave`"), "{message}");
    assert!(!folder.path().join("out").exists(), "nothing half-written");
}

#[test]
fn targets_without_frames_are_named() {
    let folder = changed(|survey| {
        let mut start = Calibration::read(survey.join("truth")).unwrap();
        start.warm_up = Some(CalibratedDrift { model: warm_up(), deviations: vec![0.0, 0.0], correlation: None });
        start.write(survey.join("calibration.ron")).unwrap();
    });
    let message = calibrate(folder.path(), |_| ()).unwrap_err().to_string();
    assert!(message.contains("lists no frame of station `") && message.contains("--warm-up leave"), "{message}");
    let left = calibrate(folder.path(), |request| request.warm_up = DriftTreatment::Leave).unwrap();
    assert!(left.converged && left.drifts.is_empty());
}
