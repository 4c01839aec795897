//! Two calibrations: of one camera, of a camera that changed, and of cameras that cannot be compared.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod common;

use std::path::{Path, PathBuf};

use common::calibration::{changed, edit, request, target_field};
use pipeline::{DiffRequest, Silent, calibrate, diff, simulate_network};

/// Calibrations of the target field's camera from sightings of another seed.
fn calibration(folder: &Path, seed: u64) -> PathBuf {
    let (survey, out) = (folder.join(format!("survey{seed}")), folder.join(format!("out{seed}")));
    simulate_network(&common::fixtures().join("networks/target_field.ron"), Some(seed), &survey).unwrap();
    calibrate(&request(&survey, &out), &Silent).unwrap();
    out.join("calibration.ron")
}

fn compare(first: &Path, second: &Path) -> pipeline::Result<pipeline::CalibrationDifference> {
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
    let (_folder, newer) = copy(&|file| edit(file, "format_version: 1", "format_version: 3"));
    let message = compare(&truth, &newer).unwrap_err().to_string();
    assert!(message.contains("format_version") && message.contains("expected 2"), "{message}");
    let level = DiffRequest { first: truth.clone(), second: truth, level: 1.5 };
    assert!(diff(&level).unwrap_err().to_string().contains("level = 1.5"));
}
