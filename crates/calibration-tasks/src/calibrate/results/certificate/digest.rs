//! Digests of what was read, so that a certificate can be held against the files.

use std::path::PathBuf;

use commands::{InputDigest, root_of};
use pipeline::Result;
use range_io::calibration::Calibration;
use range_io::survey::Survey;

use crate::calibrate::{CalibrateMethod, CalibrateRequest};

/// Files of a survey that networks are calibrated from, where they are there.
const NETWORK: [&str; 8] = [
    "survey.ron",
    "observations.csv",
    "stations.csv",
    "targets.csv",
    "distances.csv",
    "passive/survey.ron",
    "passive/calibration.ron",
    "passive/observations.csv",
];
/// Those for planes, beside the frames.
const PLANES: [&str; 3] = ["survey.ron", "stations.csv", "planes.csv"];
/// Those for surfaces, beside the frames.
const SURFACES: [&str; 2] = ["survey.ron", "stations.csv"];

/// Digests of all files that a calibration reads, in a fixed order.
pub(crate) fn digests(request: &CalibrateRequest) -> Result<Vec<InputDigest>> {
    let mut files: Vec<PathBuf> = Vec::new();
    let root = root_of(&request.survey);
    let tables: &[&str] = match request.method {
        CalibrateMethod::Planes => &PLANES,
        CalibrateMethod::Surfaces => &SURFACES,
        CalibrateMethod::Network(_) => &NETWORK,
    };
    for survey in [Some(&request.survey), request.lens_survey.as_ref()].into_iter().flatten() {
        let root = root_of(survey);
        files.extend(tables.iter().map(|name| root.join(name)));
    }
    if !matches!(request.method, CalibrateMethod::Network(_)) {
        for frame in Survey::read(&request.survey)?.frames {
            // A frame of a recording has its number behind the name of the file.
            let name = frame.file.to_string_lossy();
            let file = name.rsplit_once('#').map_or(&*name, |(file, _)| file);
            files.push(root.join(if root.join(&frame.file).is_file() { &*name } else { file }));
        }
    }
    files.push(request.calibration.clone().unwrap_or_else(|| root.join(Calibration::FILE_NAME)));
    let mut seen = std::collections::BTreeSet::new();
    files.retain(|file| file.is_file() && seen.insert(file.clone()));
    files.iter().map(InputDigest::of).collect()
}
