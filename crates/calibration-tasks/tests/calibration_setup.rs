//! Calibrations of the fixture and of copies of it.

#![allow(dead_code, clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use calibration_tasks::{
    CalibrateMethod, CalibrateRequest, CalibrationOptions, CalibrationSummary, CertificateRequest, Method, OffsetModel,
    TableDefaults, TermSelection,
};
use pipeline::{DriftTreatment, Silent};

/// The committed survey of a target field.
pub fn target_field() -> PathBuf {
    crate::common::fixtures().join("surveys/target_field")
}

/// A request by the one-step method with the terms that the fixture's truth has.
pub fn request(survey: &Path, out: &Path) -> CalibrateRequest {
    CalibrateRequest {
        survey: survey.to_owned(),
        lens_survey: None,
        calibration: None,
        method: CalibrateMethod::Network(Method::OneStep),
        options: CalibrationOptions {
            terms: terms("xp yp c k1 k2 p1 p2 d0 d4 d5 d6 d7 e1 e2"),
            ..CalibrationOptions::default()
        },
        offset: OffsetModel::Constant,
        warm_up: DriftTreatment::Apply,
        defaults: TableDefaults::default(),
        certificate: CertificateRequest::default(),
        out: out.to_owned(),
    }
}

pub fn terms(names: &str) -> TermSelection {
    TermSelection::List(names.split(' ').map(str::to_owned).collect())
}

/// A copy of the fixture in which `change` may edit its files.
pub fn changed(change: impl FnOnce(&Path)) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    copy(&target_field(), &folder.path().join("survey"));
    change(&folder.path().join("survey"));
    folder
}

/// Copies a folder with all that is in it.
pub fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().flatten() {
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// Calibrates the survey in `folder/survey` into `folder/out`.
pub fn calibrate(folder: &Path, change: impl FnOnce(&mut CalibrateRequest)) -> pipeline::Result<CalibrationSummary> {
    let mut request = request(&folder.join("survey"), &folder.join("out"));
    change(&mut request);
    calibration_tasks::calibrate(&request, &Silent)
}

/// Replaces a piece of text that must be there.
pub fn edit(file: &Path, from: &str, to: &str) {
    let text = std::fs::read_to_string(file).unwrap();
    assert!(text.contains(from), "{} does not contain {from:?}", file.display());
    std::fs::write(file, text.replacen(from, to, 1)).unwrap();
}

/// Keeps the lines of a file that `keep` likes.
pub fn keep_lines(file: &Path, keep: impl Fn(&str) -> bool) {
    let text = std::fs::read_to_string(file).unwrap();
    let kept: Vec<&str> = text.lines().filter(|line| keep(line)).collect();
    std::fs::write(file, kept.join("\n") + "\n").unwrap();
}
