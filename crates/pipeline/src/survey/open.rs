//! A survey's folder, opened: frames to views that the stages can work on.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use camera_model::{Camera, RayTable};
use error_models::RangeNoise;
use nalgebra::Isometry3;
use range_image::{Flags, Modulation, RangeFrame, Raster};
use range_io::calibration::Calibration;
use range_io::npz::NpzReader;
use range_io::survey::{InputFrame, Survey, read_frame, read_truth};
use range_io::tables::{Station, read_stations};

use crate::survey::compatible::{Purpose, compatible};
use crate::survey::plausibility;
use crate::survey::truth::ViewTruth;
use crate::survey::view::{LiveFrames, View, ViewData};
use crate::{Error, Result};
use commands::Doubt;
use commands::root_of;

/// An opened survey: all of it but its frames, which are read one by one.
pub struct OpenSurvey {
    /// What was captured.
    pub survey: Arc<Survey>,
    /// The calibration, where there is one.
    pub calibration: Option<Arc<Calibration>>,
    /// The calibration in use, in words.
    pub calibration_words: String,
    /// The camera as the survey states it.
    pub nominal_camera: Camera,
    /// The calibrated camera, where there is one.
    pub calibrated_camera: Option<Camera>,
    /// Rays of the nominal camera.
    pub rays: Arc<RayTable>,
    /// What `stations.csv` says of the stations.
    pub stated: StatedPoses,
    /// Index of the world's axis that points up: z where poses came with the survey, y in a camera's own frame.
    pub vertical_axis: usize,
    /// What speaks against survey and calibration.
    pub doubts: Vec<Doubt>,
    /// Frames that were read and are in memory.
    pub live: LiveFrames,
    root: PathBuf,
    depth_rays: Arc<RayTable>,
    true_poses: StatedPoses,
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
) -> Result<OpenSurvey> {
    let survey = Survey::read(folder)?;
    if survey.frames.is_empty() {
        return Err(Error::Survey { path: folder.join(Survey::FILE_NAME), message: "it lists no frames".to_owned() });
    }
    let root = root_of(folder);
    let nominal_camera = survey.camera.nominal_camera()?;
    let fit = calibration.as_ref().map(|calibration| compatible(&survey, calibration, purpose)).transpose()?;
    let (calibrated_camera, mut doubts) = fit.map_or((None, Vec::new()), |fit| (Some(fit.camera), fit.doubts));
    doubts.extend(plausibility::of_survey(&survey.camera));
    let table = |camera| RayTable::new(camera).map(Arc::new).map_err(|error| Error::Camera(error.to_string()));
    let rays = table(&nominal_camera)?;
    let depth_rays = calibrated_camera.as_ref().map_or_else(|| Ok(Arc::clone(&rays)), table)?;
    let stated = read_poses(&root.join("stations.csv"))?;
    let places: Vec<Isometry3<f64>> = stated.iter().map(|row| row.world_from_camera).collect();
    doubts.extend(plausibility::far_apart(&places));
    let true_poses = match survey.truth.as_ref().and_then(|truth| truth.stations.as_ref()) {
        Some(file) => read_stations(root.join(file))?,
        None => Vec::new(),
    };
    Ok(OpenSurvey {
        nominal_camera,
        calibrated_camera,
        rays,
        vertical_axis: if stated.is_empty() { 1 } else { 2 },
        stated: StatedPoses::new(stated),
        doubts,
        depth_rays,
        true_poses: StatedPoses::new(true_poses),
        reference: read_reference(&survey, &root)?,
        modulations: survey.camera.modulations()?,
        range_noise: calibration.as_ref().and_then(|calibration| calibration.range_noise),
        live: LiveFrames::default(),
        root,
        survey: Arc::new(survey),
        calibration: calibration.map(Arc::new),
        calibration_words,
    })
}

impl OpenSurvey {
    /// Reads frame `index` (from 0) with its pose and truth.
    pub fn view(&self, index: usize) -> Result<View> {
        let survey = &self.survey;
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
            cloud: None,
            further_points: Vec::new(),
            live: self.live.clone(),
        };
        view.before = view.snapshot();
        Ok(view)
    }

    /// The calibrated camera, or else the nominal one.
    pub fn best_camera(&self) -> Camera {
        self.calibrated_camera.unwrap_or(self.nominal_camera)
    }

    /// Rays of the camera in use, by which depths become ranges.
    pub(crate) fn depth_rays(&self) -> &RayTable {
        &self.depth_rays
    }

    /// The modulations that the survey states.
    pub(crate) fn modulations(&self) -> &[Modulation] {
        &self.modulations
    }

    /// Whether the true ranges of its frames are known.
    pub(crate) fn has_truth(&self) -> bool {
        self.survey.truth.as_ref().is_some_and(|truth| !truth.frames.is_empty())
    }

    /// Where the survey says that a station stands.
    pub fn approximate_pose(&self, station: &str) -> Option<Isometry3<f64>> {
        self.stated.of(station).map(|row| row.world_from_camera)
    }

    /// Where it truly stands, of simulated surveys.
    pub fn true_pose(&self, station: &str) -> Option<Isometry3<f64>> {
        self.true_poses.of(station).map(|row| row.world_from_camera)
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

/// What a `stations.csv` says, found by the names of the stations: a stream may have a hundred thousand.
#[derive(Debug, Clone, Default)]
pub struct StatedPoses {
    rows: Vec<Station>,
    places: BTreeMap<String, usize>,
}

impl StatedPoses {
    fn new(rows: Vec<Station>) -> Self {
        let mut places = BTreeMap::new();
        for (place, row) in rows.iter().enumerate() {
            places.entry(row.station.clone()).or_insert(place);
        }
        Self { rows, places }
    }

    /// What it says of a station; of several rows the first.
    pub fn of(&self, station: &str) -> Option<&Station> {
        self.places.get(station).map(|place| &self.rows[*place])
    }

    /// Its rows.
    pub fn into_rows(self) -> Vec<Station> {
        self.rows
    }
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
