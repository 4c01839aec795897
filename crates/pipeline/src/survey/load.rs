//! A survey's folder to views that the stages can work on.

use std::path::{Path, PathBuf};

use camera_model::RayTable;
use error_models::RangeNoise;
use nalgebra::Isometry3;
use range_image::{Flags, Modulation, RangeFrame, Raster};
use range_io::calibration::Calibration;
use range_io::npz::NpzReader;
use range_io::survey::{InputFrame, Survey, read_frame, read_truth};
use range_io::tables::{Station, read_stations};

use crate::command::destination::root_of;
use crate::command::progress::Progress;
use crate::survey::compatible::{Purpose, compatible};
use crate::survey::outcome::Outcome;
use crate::survey::plausibility::{self, FrameWatch};
use crate::survey::span::SpanTally;
use crate::survey::truth::ViewTruth;
use crate::survey::view::{View, ViewData};
use crate::survey::work::Work;
use crate::{Error, Plan, Result};

/// Reads survey, poses, truth and all frames - those of one station, where one is named; refuses a plan that the survey's
/// level rules out. The calibration comes with its name in words.
pub fn load(
    folder: &Path,
    calibration: (Option<Calibration>, String),
    plan: &Plan,
    only: Option<&str>,
    progress: &dyn Progress,
) -> Result<Work> {
    let (mut work, frames) = open(folder, calibration, Purpose::of(&plan.stages))?;
    let count = work.outcome.survey.frames.len();
    plan.check_level(work.outcome.survey.level)?;
    progress.begin("read frames", count);
    let mut watch = FrameWatch::default();
    for index in 0..count {
        if only.is_none_or(|only| only == work.outcome.survey.frames[index].station) {
            let view = frames.view(&work.outcome.survey, index)?;
            watch.look(&view);
            work.outcome.views.push(view);
        }
        progress.advance(index + 1);
    }
    work.outcome.doubts.extend(watch.doubts());
    Ok(work)
}

/// What the frames of a survey have in common.
pub struct Frames {
    root: PathBuf,
    depth_rays: RayTable,
    poses: Vec<Station>,
    true_poses: Vec<Station>,
    reference: Option<Raster<f32>>,
    modulations: Vec<Modulation>,
    /// Gives frames without a standard deviation one.
    range_noise: Option<RangeNoise>,
}

/// Reads all of a survey but its frames, for a calibration that is used as `purpose` says.
pub fn open(
    folder: &Path,
    (calibration, calibration_words): (Option<Calibration>, String),
    purpose: Purpose,
) -> Result<(Work, Frames)> {
    let survey = Survey::read(folder)?;
    if survey.frames.is_empty() {
        return Err(Error::Survey { path: folder.join(Survey::FILE_NAME), message: "it lists no frames".to_owned() });
    }
    let root = root_of(folder);
    let camera = survey.camera.nominal_camera()?;
    let fit = calibration.as_ref().map(|calibration| compatible(&survey, calibration, purpose)).transpose()?;
    let (calibrated_camera, mut doubts) = fit.map_or((None, Vec::new()), |fit| (Some(fit.camera), fit.doubts));
    doubts.extend(plausibility::of_survey(&survey.camera));
    let rays = RayTable::new(&camera).map_err(|error| Error::Camera(error.to_string()))?;
    let depth_rays = match &calibrated_camera {
        Some(camera) => RayTable::new(camera).map_err(|error| Error::Camera(error.to_string()))?,
        None => rays.clone(),
    };
    let poses = read_poses(&root.join("stations.csv"))?;
    let places: Vec<Isometry3<f64>> = poses.iter().map(|row| row.world_from_camera).collect();
    doubts.extend(plausibility::far_apart(&places));
    let true_poses = match survey.truth.as_ref().and_then(|truth| truth.stations.as_ref()) {
        Some(file) => read_stations(root.join(file))?,
        None => Vec::new(),
    };
    let reference = read_reference(&survey, &root)?;
    let modulations = survey.camera.modulations()?;
    let vertical_axis = if poses.is_empty() { 1 } else { 2 };
    let outcome = Outcome {
        survey,
        calibration: calibration_words,
        camera,
        views: Vec::new(),
        clouds: Vec::new(),
        further_points: Vec::new(),
        poses: Vec::new(),
        pairs: Vec::new(),
        refused: Vec::new(),
        adjustment: None,
        stages: Vec::new(),
        refusal: None,
        doubts,
        stated: poses.clone(),
        vertical_axis,
    };
    let span = SpanTally::default();
    let range_noise = calibration.as_ref().and_then(|calibration| calibration.range_noise);
    let frames = Frames { root, depth_rays, poses, true_poses, reference, modulations, range_noise };
    let (station_clouds, low_amplitude) = (Vec::new(), None);
    let work = Work { calibration, calibrated_camera, rays, low_amplitude, station_clouds, span, outcome };
    Ok((work, frames))
}

impl Frames {
    /// Reads frame `index` (from 0) with its pose and truth.
    pub fn view(&self, survey: &Survey, index: usize) -> Result<View> {
        let entry = &survey.frames[index];
        let mut view = View {
            station: entry.station.clone(),
            frames: vec![index],
            timestamp_s: entry.timestamp_s.unwrap_or(0.0),
            integration_time_s: entry.integration_time_s,
            data: with_sigma(view_data(read_frame(survey, &self.root, index)?, &self.depth_rays)?, self.range_noise)?,
            before: None,
            approximate_world_from_camera: self.approximate_pose(&entry.station),
            truth: read_view_truth(survey, &self.root, index, self.true_pose(&entry.station))?,
            reference_range: self.reference.clone(),
            modulation: self.modulations.first().copied(),
            channels: Vec::new(),
            modulations: self.modulations.clone(),
            multipath_risk_m: None,
            correction: None,
        };
        view.before = view.snapshot();
        Ok(view)
    }

    /// Where the survey says that a station stands.
    pub fn approximate_pose(&self, station: &str) -> Option<Isometry3<f64>> {
        pose_of(&self.poses, station)
    }

    /// Where it truly stands, of simulated surveys.
    pub fn true_pose(&self, station: &str) -> Option<Isometry3<f64>> {
        pose_of(&self.true_poses, station)
    }
}

/// The named calibration, or the one beside the survey, and what to call it.
pub fn read_calibration(root: &Path, named: Option<&Path>) -> Result<(Option<Calibration>, String)> {
    let beside = root.join("calibration.ron");
    let path = match named {
        Some(path) => path.to_owned(),
        None if beside.is_file() => beside,
        None => return Ok((None, "none: nominal camera".to_owned())),
    };
    let calibration = Calibration::read(&path)?;
    let words = format!("{} ({})", path.display(), calibration.provenance.method);
    Ok((Some(calibration), words))
}

/// The rows of `stations.csv`; none where there is no such file.
pub fn read_poses(file: &Path) -> Result<Vec<Station>> {
    if file.is_file() { Ok(read_stations(file)?) } else { Ok(Vec::new()) }
}

fn pose_of(poses: &[Station], station: &str) -> Option<Isometry3<f64>> {
    poses.iter().find(|row| row.station == station).map(|row| row.world_from_camera)
}

fn read_view_truth(
    survey: &Survey,
    root: &Path,
    index: usize,
    pose: Option<Isometry3<f64>>,
) -> Result<Option<ViewTruth>> {
    let truth = read_truth(survey, root, index)?;
    Ok(truth.map(|truth| ViewTruth { range: truth.range, world_from_camera: pose }))
}

/// The plane of `extras: {"reference_range": ...}`, the same for all frames.
fn read_reference(survey: &Survey, root: &Path) -> Result<Option<Raster<f32>>> {
    let Some(file) = survey.extras.get("reference_range") else { return Ok(None) };
    let path = root.join(file);
    let mut arrays = NpzReader::open(&path)?;
    let (name, scale) = if arrays.contains("range") { ("range", 1.0) } else { ("range_mm", 1e-3) };
    let (width, height) = (survey.camera.width, survey.camera.height);
    let array = arrays.read(name, |header| match header.shape.as_slice() {
        [rows, cols] if (*rows, *cols) == (height, width) => Ok(()),
        found => Err(range_io::Error::ArrayShape {
            file: path.clone(),
            array: name.to_owned(),
            found: found.to_vec(),
            expected: format!("[{height}, {width}]"),
        }),
    })?;
    let values: Vec<f32> = array.values.into_f32().into_iter().map(|value| value * scale).collect();
    let plane = Raster::from_vec(width, height, values);
    let plane = plane.map_err(|error| Error::Survey { path, message: format!("array `{name}`: {error}") })?;
    Ok(Some(plane))
}

/// Depths become ranges here, where the rays are known.
fn view_data(frame: InputFrame, rays: &RayTable) -> Result<ViewData> {
    let camera = |error: camera_model::Error| Error::Camera(error.to_string());
    match frame {
        InputFrame::Samples(raw) => Ok(ViewData::Samples(raw)),
        InputFrame::Phase(frame) => Ok(ViewData::Phase(frame)),
        InputFrame::Range { range, amplitude, .. } => Ok(ViewData::Range(range_frame(range, amplitude))),
        InputFrame::Depth { depth, amplitude, .. } => {
            let range = rays.depth_to_range(&depth).map_err(camera)?;
            Ok(ViewData::Range(range_frame(range, amplitude)))
        }
        other => Err(Error::Camera(format!("frames at level `{}` can't be processed", other.level().name()))),
    }
}

/// The calibrated noise of ranges gives frames without a standard deviation one.
fn with_sigma(mut data: ViewData, noise: Option<RangeNoise>) -> Result<ViewData> {
    let Some(noise) = noise else { return Ok(data) };
    let predicted = match &mut data {
        ViewData::Samples(_) => Ok(()),
        ViewData::Phase(frame) => noise.predict_complex_sigma(frame),
        ViewData::Range(frame) => noise.predict_sigma(frame),
    };
    predicted.map_err(|error| Error::Camera(error.to_string()))?;
    Ok(data)
}

/// A range frame whose pixels without a positive range are flagged and NaN.
fn range_frame(mut range: Raster<f32>, amplitude: Option<Raster<f32>>) -> RangeFrame {
    let (width, height) = (range.width(), range.height());
    let mut flags = Raster::filled(width, height, Flags::empty());
    for (range, flags) in range.as_mut_slice().iter_mut().zip(flags.as_mut_slice()) {
        if !(range.is_finite() && *range > 0.0) {
            *range = f32::NAN;
            flags.insert(Flags::NO_DATA);
        }
    }
    let unknown = || Raster::filled(width, height, f32::NAN);
    RangeFrame { range, sigma: unknown(), amplitude: amplitude.unwrap_or_else(unknown), flags }
}

/// Modulation of the first frequency.
pub fn first_modulation(outcome: &Outcome) -> Option<Modulation> {
    outcome.views.first().and_then(|view| view.modulation)
}
