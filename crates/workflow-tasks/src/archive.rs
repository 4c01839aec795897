//! An archive of recordings: which cameras, days and surveys there are.

use std::fs;
use std::path::{Path, PathBuf};

use commands::{Error, Result};
use range_io::calibration::Calibration;
use serde::Serialize;

/// Folder of a camera with the survey that it is calibrated from.
pub(crate) const CALIBRATION: &str = "calibration";
/// Folder of a day with the survey that its calibration is checked with.
pub(crate) const CHECK: &str = "check";
/// Folder of a day with the survey that its drift is told by.
pub(crate) const WARM_UP: &str = "warmup";

/// What an archive holds, by name and in the order of the names.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct Archive {
    pub(crate) cameras: Vec<ArchivedCamera>,
}

/// A camera with its days.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct ArchivedCamera {
    pub(crate) name: String,
    /// How it is calibrated.
    pub(crate) calibration: CalibrationSource,
    pub(crate) days: Vec<ArchivedDay>,
}

/// Where a camera's calibration comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(crate) enum CalibrationSource {
    /// The survey in its folder, by the method that the files in it allow.
    Survey(&'static str),
    /// A file that is there already.
    File,
    /// Each recording has its own, or none.
    Recordings,
}

/// A day of a camera.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct ArchivedDay {
    pub(crate) name: String,
    pub(crate) checked: bool,
    pub(crate) warms_up: bool,
    pub(crate) recordings: Vec<String>,
}

impl Archive {
    /// Looks through the folders of an archive; what is in a recording is looked at when it is processed.
    pub(crate) fn read(root: &Path) -> Result<Self> {
        let cameras = folders(root)?.into_iter().map(|name| camera(root, name)).collect::<Result<Vec<_>>>()?;
        let archive = Self { cameras };
        if archive.recordings() == 0 {
            let message = format!(
                "{}: holds no recording: expected CAMERA/DAY/RECORDING/survey.ron, and CAMERA/{CALIBRATION} for its calibration",
                root.display()
            );
            return Err(Error::Request { command: "workflow", message });
        }
        Ok(archive)
    }

    /// Recordings of all cameras.
    pub(crate) fn recordings(&self) -> usize {
        self.days().map(|(_, day)| day.recordings.len()).sum()
    }

    /// Days of all cameras, with the camera's name.
    pub(crate) fn days(&self) -> impl Iterator<Item = (&str, &ArchivedDay)> {
        self.cameras.iter().flat_map(|camera| camera.days.iter().map(move |day| (camera.name.as_str(), day)))
    }
}

fn camera(root: &Path, name: String) -> Result<ArchivedCamera> {
    let folder = root.join(&name);
    let survey = folder.join(CALIBRATION);
    let calibration = if survey.is_dir() {
        CalibrationSource::Survey(method(&survey))
    } else if folder.join(Calibration::FILE_NAME).is_file() {
        CalibrationSource::File
    } else {
        CalibrationSource::Recordings
    };
    let days = folders(&folder)?.into_iter().filter(|day| day != CALIBRATION).map(|day| {
        let within = folders(&folder.join(&day))?;
        let has = |name: &str| within.iter().any(|other| other == name);
        let (checked, warms_up) = (has(CHECK), has(WARM_UP));
        let recordings = within.into_iter().filter(|name| name != CHECK && name != WARM_UP).collect();
        Ok(ArchivedDay { name: day, checked, warms_up, recordings })
    });
    Ok(ArchivedCamera { name, calibration, days: days.collect::<Result<Vec<_>>>()? })
}

/// Arguments of `rangecam calibrate` for what a survey has.
fn method(survey: &Path) -> &'static str {
    let has = |file: &str| survey.join(file).is_file();
    match (has("observations.csv") || has("rig.ron"), has("planes.csv")) {
        (true, _) => "--method one-step",
        (false, true) => "--method planes",
        (false, false) => "--method surfaces",
    }
}

/// Names of the folders in a folder, hidden ones left out.
fn folders(root: &Path) -> Result<Vec<String>> {
    let access = |source| Error::Access { path: root.to_owned(), source };
    let mut names = Vec::new();
    for entry in fs::read_dir(root).map_err(access)? {
        let path: PathBuf = entry.map_err(access)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if !path.is_dir() || name.starts_with('.') {
            continue;
        }
        if !is_plain(&name) {
            let message = format!(
                "{}: the names of cameras, days and recordings become those of jobs and files: expected letters, digits, `-`, `_` \
                 and `.` alone",
                path.display()
            );
            return Err(Error::Request { command: "workflow", message });
        }
        names.push(name);
    }
    names.sort();
    Ok(names)
}

/// Whether a name means nothing but itself to a shell, a pattern or a file system.
fn is_plain(name: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || ['-', '_', '.'].contains(&c);
    !name.is_empty() && !name.starts_with('-') && name.chars().all(plain)
}
