//! Two calibrations: of one camera, of a camera that changed, and of cameras that cannot be compared.

use std::path::{Path, PathBuf};

use calibration_tasks::{DiffRequest, calibrate, diff, simulate_network};
use error_models::{FrameRateDrift, Transient, WarmUp};
use pipeline::Silent;
use range_io::calibration::{CalibratedDrift, Calibration};

use crate::calibration_setup::{changed, edit, request, target_field};
use crate::common;

/// Calibrations of the target field's camera from sightings of another seed.
fn calibration(folder: &Path, seed: u64) -> PathBuf {
    let (survey, out) = (folder.join(format!("survey{seed}")), folder.join(format!("out{seed}")));
    simulate_network(&common::fixtures().join("networks/target_field.ron"), Some(seed), &survey).unwrap();
    calibrate(&request(&survey, &out), &Silent).unwrap();
    out.join("calibration.ron")
}

fn compare(first: &Path, second: &Path) -> pipeline::Result<calibration_tasks::CalibrationDifference> {
    diff(&DiffRequest { first: first.to_owned(), second: second.to_owned(), level: 0.01 })
}

#[test]
fn calibrations_of_one_camera_do_not_differ_and_of_a_changed_one_do() {
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (calibration(folder.path(), 101), calibration(folder.path(), 102));
    let same = compare(&first, &second).unwrap();
    println!("{same}");
    assert!(!same.significant, "{same}");
    let joint = same.joint.as_ref().unwrap();
    // xp yp c k1 k2 p1 p2 d0 d4 d5 d6 d7 e1 e2.
    assert_eq!(joint.degrees, 14);
    assert!(same.parameters.iter().any(|line| line.name == "d2" && line.status == "held" && !line.significant));
    assert!(compare(&first, first.parent().unwrap()).unwrap().corrections[0].rms_m == 0.0, "a file against its folder");

    // The offset moves by 20 mm: each calibration knows it to two millimetres.
    let text = std::fs::read_to_string(&second).unwrap();
    let d0 = same.parameters.iter().find(|line| line.name == "d0").unwrap().second;
    let moved = folder.path().join("moved.ron");
    std::fs::write(&moved, text.replacen(&format!("value: {d0}"), &format!("value: {}", d0 + 0.02), 1)).unwrap();
    let other = compare(&first, &moved).unwrap();
    println!("{other}");
    assert!(other.significant && other.joint.as_ref().unwrap().significant);
    let named: Vec<&str> =
        other.parameters.iter().filter(|line| line.significant).map(|line| line.name.as_str()).collect();
    assert_eq!(named, ["d0"]);
    let correction = &other.corrections[0];
    assert!(correction.significant && (correction.largest.difference_m - 0.02).abs() < 0.005, "{correction:?}");
    assert!(!other.image.as_ref().unwrap().significant, "the lens did not change");
    assert!(other.to_string().contains("differ significantly"));
}

#[test]
fn what_cannot_be_compared_is_named() {
    let truth = target_field().join("truth/calibration.ron");
    let copy = |change: &dyn Fn(&Path)| {
        let folder = changed(|survey| change(&survey.join("truth/calibration.ron")));
        let path = folder.path().join("survey/truth/calibration.ron");
        (folder, path)
    };
    // Held in both: values are compared as they stand.
    let equal = compare(&truth, &truth).unwrap();
    assert!(!equal.significant && equal.joint.is_none(), "{equal}");
    let (_folder, wider) = copy(&|file| edit(file, "width: 176", "width: 200"));
    let message = compare(&truth, &wider).unwrap_err().to_string();
    assert!(
        message.contains("different cameras: the first has 176 x 144") && message.contains("200 x 144"),
        "{message}"
    );
    let (_folder, newer) = copy(&|file| edit(file, "format_version: 2", "format_version: 3"));
    let message = compare(&truth, &newer).unwrap_err().to_string();
    assert!(message.contains("format_version") && message.contains("expected 2"), "{message}");
    let level = DiffRequest { first: truth.clone(), second: truth, level: 1.5 };
    assert!(diff(&level).unwrap_err().to_string().contains("level = 1.5"));
}

#[test]
fn drifts_are_compared_by_parameters_and_by_what_they_do() {
    let folder = tempfile::tempdir().unwrap();
    let with = |name: &str, amplitude_m: f64, more: bool| {
        let mut calibration = Calibration::read(target_field().join("truth/calibration.ron")).unwrap();
        let mut transients = vec![Transient { amplitude_m, time_constant_s: 600.0 }];
        transients.extend(more.then_some(Transient { amplitude_m: 0.001, time_constant_s: 60.0 }));
        let model = WarmUp { transients, time_span_s: Some([10.0, 3000.0]), ..WarmUp::default() };
        let deviations = [0.0005, 15.0].repeat(model.transients.len());
        calibration.warm_up = Some(CalibratedDrift { model, deviations, correlation: None });
        let file = folder.path().join(name);
        calibration.write(&file).unwrap();
        file
    };
    let (first, same, other) = (with("a.ron", 0.03, false), with("b.ron", 0.0302, false), with("c.ron", 0.025, false));
    let found = compare(&first, &same).unwrap();
    assert!(!found.significant && !found.drift.as_ref().unwrap().significant, "{found}");
    let found = compare(&first, &other).unwrap();
    println!("{found}");
    let line = found.drift.as_ref().unwrap();
    assert!(found.significant && line.significant && (line.largest.difference_m + 0.0049).abs() < 1e-4, "{line:?}");
    assert!(found.to_string().contains("drift: differs by up to -4.92 mm"), "{found}");
    let named: Vec<&str> =
        found.parameters.iter().filter(|line| line.significant).map(|line| line.name.as_str()).collect();
    assert_eq!(named, ["warm-up A1"]);
    let a1 = found.parameters.iter().find(|line| line.name == "warm-up A1").unwrap();
    assert!((a1.sigma - 0.0005 * 2.0_f64.sqrt()).abs() < 1e-12 && a1.unit == "m" && a1.status == "estimated");
    // Exponentials of which one file has more have no partners; the curves have.
    let found = compare(&first, &with("d.ron", 0.03, true)).unwrap();
    assert!(found.drift.is_some() && found.parameters.iter().all(|line| !line.name.contains("warm-up")), "{found}");
    let found = compare(&first, &target_field().join("truth/calibration.ron")).unwrap();
    assert_eq!((found.drift.is_none(), found.only_first), (true, vec!["drift of the warming camera".to_owned()]));
}

#[test]
fn drifts_that_follow_the_frame_rate_are_compared_by_it() {
    let folder = tempfile::tempdir().unwrap();
    let with = |name: &str, coefficient_m_per_hz: f64| {
        let mut calibration = Calibration::read(target_field().join("truth/calibration.ron")).unwrap();
        let span_hz = Some([0.5, 10.0]);
        let part = FrameRateDrift { coefficient_m_per_hz, time_constant_s: 900.0, reference_hz: 0.5, span_hz };
        let model = WarmUp { frame_rate: Some(part), time_span_s: Some([10.0, 9000.0]), ..WarmUp::default() };
        calibration.warm_up = Some(CalibratedDrift { model, deviations: vec![5e-5, 20.0], correlation: None });
        let file = folder.path().join(name);
        calibration.write(&file).unwrap();
        file
    };
    let (first, same, other) = (with("a.ron", 0.003), with("b.ron", 0.00302), with("c.ron", 0.002));
    assert!(!compare(&first, &same).unwrap().significant);
    let found = compare(&first, &other).unwrap();
    println!("{found}");
    let named: Vec<&str> =
        found.parameters.iter().filter(|line| line.significant).map(|line| line.name.as_str()).collect();
    assert_eq!(named, ["warm-up cF"]);
    // 1 mm/Hz over 9.5 Hz, at the end of the times.
    let line = found.drift.as_ref().unwrap();
    assert!((line.largest.difference_m + 0.0095).abs() < 1e-5 && line.largest.rate_hz == Some(10.0), "{line:?}");
    assert!(found.to_string().contains("at 10.00 Hz"), "{found}");
}

#[test]
fn range_models_of_another_frequency_or_time_cannot_be_compared() {
    let truth = target_field().join("truth/calibration.ron");
    let text = std::fs::read_to_string(&truth).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let other = folder.path().join("other.ron");
    for (from, to, words) in [
        ("modulation_hz: 20000000.0", "modulation_hz: 30e6", ["20 MHz", "30 MHz"]),
        ("integration_time_s: 1.0", "integration_time_s: 2.0", ["1000 ms", "2000 ms"]),
    ] {
        assert!(text.contains(from), "{from} in {text}");
        std::fs::write(&other, text.replace(from, to)).unwrap();
        let error = compare(&truth, &other).unwrap_err();
        assert_eq!(error.failure(), pipeline::Failure::Usage);
        assert!(words.iter().all(|word| error.to_string().contains(word)), "{error}");
    }
}
