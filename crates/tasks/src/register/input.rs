//! Surveys and clouds as stations with points, normals and what is known of them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use commands::memory::{FrameBytes, keeping};
use commands::plan::{
    CorrectImagePointOptions, CorrectRangeOptions, FlagOptions, FuseExposuresOptions, PointCloudOptions, to_ranges,
};
use commands::{Doubt, Progress, root_of};
use multiview_registration::MeasuredTurn;
use pipeline::run::process_each;
use pipeline::stages::corrects_ranges;
use pipeline::stations::{Station, projection};
use pipeline::survey::{OpenSurvey, View, plausibility, read_calibration};
use pipeline::{Error, Plan, Result, Stage};
use range_io::calibration::Calibration;
use range_io::clouds::read_any_cloud;
use range_io::survey::{Level, Survey};
use statistics::quantile;

use crate::inertial_unit;
use crate::register::{RegisterMethod, RegisterRequest};

/// Of a point of a station: as it is read (34), and with normals, neighbours and partners while stations are registered.
const BYTES_A_POINT: u64 = 200;

/// Everything that is to be registered.
pub(crate) struct Input {
    /// At least two.
    pub(crate) stations: Vec<Station>,
    /// Index of the axis of the common frame that points up, as far as one can tell.
    pub(crate) vertical_axis: usize,
    /// Turns from station to station, where the survey has an inertial unit.
    pub(crate) turns: Vec<MeasuredTurn>,
    /// What speaks against the frames.
    pub(crate) doubts: Vec<Doubt>,
}

/// Reads what was named.
pub(crate) fn read(request: &RegisterRequest, progress: &dyn Progress) -> Result<Input> {
    if let Some(missing) = request.inputs.iter().find(|path| !path.exists()) {
        return Err(request_error(format!("{}: there is no such file or folder", missing.display())));
    }
    match request.inputs.as_slice() {
        [] => Err(request_error("no input is named: name one survey folder, or two and more clouds".into())),
        [survey] if is_survey(survey) => survey_stations(survey, request, progress),
        [cloud] => Err(request_error(format!(
            "{} is one cloud: name a second one to be brought onto it, or a survey folder",
            cloud.display()
        ))),
        several => {
            if let Some(survey) = several.iter().find(|path| is_survey(path)) {
                return Err(request_error(format!(
                    "{} is a folder among several inputs: name one survey, or clouds only",
                    survey.display()
                )));
            }
            cloud_stations(several, progress)
        }
    }
}

fn request_error(message: String) -> Error {
    Error::Request { command: "register", message }
}

/// Whether the path is a folder with `survey.ron`, or that file.
pub(crate) fn is_survey(path: &Path) -> bool {
    path.is_dir() || path.file_name().is_some_and(|name| name == Survey::FILE_NAME)
}

fn survey_stations(path: &Path, request: &RegisterRequest, progress: &dyn Progress) -> Result<Input> {
    let survey = Survey::read(path)?;
    let first = survey.frames.first().map(|frame| &frame.station);
    if survey.frames.iter().all(|frame| Some(&frame.station) == first) {
        return Err(request_error(format!(
            "{}: all {} frames belong to one station, whose frames are averaged; at least two stations are needed",
            path.display(),
            survey.frames.len()
        )));
    }
    let known = read_calibration(&root_of(path), request.calibration.as_deref())?;
    let stages = stages(survey.level, known.0.as_ref());
    let plan = Plan { name: "register".to_owned(), source: None, calibrate: None, stages };
    let mut stations = Vec::new();
    let mut keep = |view: View, survey: &OpenSurvey| {
        stations.extend(Station::of_view(&view, &survey.stated, None));
        Ok(())
    };
    let names: BTreeSet<&str> = survey.frames.iter().map(|frame| frame.station.as_str()).collect();
    let kept = BYTES_A_POINT * FrameBytes::of(&survey).pixels * names.len() as u64;
    let processed = keeping(kept, || process_each(&plan, &root_of(path), known, &mut keep, progress))?;
    let projection = projection(&processed.camera);
    for station in &mut stations {
        station.projection.clone_from(&projection);
    }
    let mut doubts = processed.doubts;
    doubts.extend(plausibility::of_views(&processed.records, &[]));
    let turns = if request.method == RegisterMethod::Multi {
        inertial_unit::turns(path, &survey, &stations)?
    } else {
        Vec::new()
    };
    Ok(Input { stations, vertical_axis: processed.vertical_axis, turns, doubts })
}

/// The way from the survey's level to flagged points, as far as the calibration has something to say.
pub(crate) fn stages(level: Level, calibration: Option<&Calibration>) -> Vec<Stage> {
    let mut stages = to_ranges(level, calibration.is_some_and(|calibration| calibration.scattering.is_some()));
    if let Some(calibration) = calibration {
        // A camera that corrects its ranges itself has a calibration of its lens alone.
        if corrects_ranges(calibration) {
            stages.push(Stage::CorrectRange(CorrectRangeOptions::default()));
        }
        stages.push(Stage::CorrectImagePoint(CorrectImagePointOptions::default()));
    }
    stages.push(Stage::FuseExposures(FuseExposuresOptions::default()));
    stages.push(Stage::PointCloud(PointCloudOptions::default()));
    stages.push(Stage::Flag(FlagOptions::default()));
    stages
}

fn cloud_stations(paths: &[PathBuf], progress: &dyn Progress) -> Result<Input> {
    progress.begin("read clouds", paths.len());
    let mut stations: Vec<Station> = Vec::with_capacity(paths.len());
    for (index, path) in paths.iter().enumerate() {
        let file = read_any_cloud(path)?;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let taken = stations.iter().any(|station| station.name == stem);
        stations.push(Station {
            name: if taken { format!("{stem}-{index}") } else { stem },
            timestamp_s: index as f64,
            approximate: file.world_from_cloud,
            approximate_sigma: [None; 2],
            file,
            projection: None,
            truth: None,
        });
        progress.advance(index + 1);
    }
    let vertical_axis = flattest(&stations[0].file.points);
    Ok(Input { stations, vertical_axis, turns: Vec::new(), doubts: Vec::new() })
}

/// The axis along which the cloud is thinnest: up, where the cloud is of a landscape or of rooms.
fn flattest(points: &[[f64; 3]]) -> usize {
    let extent = |axis: usize| {
        let mut values: Vec<f64> = points.iter().map(|point| point[axis]).collect();
        quantile(&mut values, 0.99) - quantile(&mut values, 0.01)
    };
    let extents = [extent(0), extent(1), extent(2)];
    [2, 1, 0].into_iter().min_by(|&a, &b| extents[a].total_cmp(&extents[b])).unwrap_or(2)
}
