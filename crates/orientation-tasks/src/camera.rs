//! The survey's camera, and ranges of its tables freed of their systematic errors.

use std::path::{Path, PathBuf};

use camera_model::Camera;
use commands::plan::DriftTreatment;
use commands::{Doubt, DoubtKind, root_of};
use error_models::{InterpolatedModel, ModelSet};
use pipeline::survey::{Purpose, compatible, model_set, read_calibration};
use pipeline::{Error, Result};
use range_io::survey::Survey;

/// A survey without its frames, and what is known of its camera.
pub(crate) struct SurveyCamera {
    pub(crate) survey: Survey,
    pub(crate) root: PathBuf,
    pub(crate) camera: Camera,
    pub(crate) calibration_words: String,
    /// Range models; `None` where ranges stay as they are.
    models: Option<ModelSet>,
    /// What speaks against the calibration.
    pub(crate) doubts: Vec<Doubt>,
    has_drift: bool,
}

impl SurveyCamera {
    pub(crate) fn open(path: &Path, named: Option<&Path>) -> Result<Self> {
        let survey = Survey::read(path)?;
        let root = root_of(path);
        let (calibration, calibration_words) = read_calibration(&root, named)?;
        let mut opened = Self {
            camera: survey.camera.nominal_camera()?,
            models: None,
            doubts: Vec::new(),
            has_drift: false,
            calibration_words,
            survey,
            root,
        };
        if let Some(calibration) = calibration {
            let fit = compatible(&opened.survey, &calibration, Purpose::Ranges(DriftTreatment::Leave))?;
            let models = model_set(&opened.survey, &calibration)?;
            (opened.camera, opened.doubts) = (fit.camera, fit.doubts);
            opened.models = Some(models).filter(|models| !models.entries.is_empty());
            opened.has_drift = calibration.warm_up.is_some();
        }
        Ok(opened)
    }

    /// What speaks against ranges of its tables, where any are used.
    pub(crate) fn doubt_of_ranges(&self) -> Option<Doubt> {
        let words = if self.models.is_none() {
            "ranges were used as they are in observations.csv: no calibration with range models takes their systematic errors off, \
             and an offset of 20 mm moves a station by as much. Name one by --calibration, or leave the column `range` empty"
        } else if self.has_drift {
            "the drift of the warming camera was not taken off the ranges: observations.csv has no times"
        } else {
            return None;
        };
        Some(Doubt::new(DoubtKind::Calibration, words))
    }

    /// When the first frame of a station was taken, and for how long it was exposed, second.
    pub(crate) fn times(&self, station: &str) -> [Option<f64>; 2] {
        let frame = self.survey.frames.iter().find(|frame| frame.station == station);
        [frame.and_then(|frame| frame.timestamp_s), frame.and_then(|frame| frame.integration_time_s)]
    }

    /// Stations in the order of the frames with the time of their first frame.
    ///
    /// # Errors
    /// [`Error::Survey`] without frames, or for a frame without a time.
    pub(crate) fn timed_stations(&self) -> Result<Vec<(String, f64)>> {
        let wrong = |message: String| Error::Survey { path: self.root.join(Survey::FILE_NAME), message };
        let mut stations: Vec<(String, f64)> = Vec::new();
        let mut known = std::collections::BTreeSet::new();
        for (index, frame) in self.survey.frames.iter().enumerate() {
            if !known.insert(frame.station.as_str()) {
                continue;
            }
            let time_s = frame.timestamp_s.ok_or_else(|| {
                wrong(format!(
                    "frame {index} (station {}) has no `timestamp_s`, by which its pose is looked up",
                    frame.station
                ))
            })?;
            stations.push((frame.station.clone(), time_s));
        }
        if stations.is_empty() {
            return Err(wrong("it lists no frames, expected those whose poses are asked for".to_owned()));
        }
        Ok(stations)
    }

    /// A range without its systematic errors, metre; NaN where the models have none for it.
    ///
    /// # Errors
    /// [`Error::Incompatible`] for an integration time that no model belongs to.
    pub(crate) fn corrected(
        &self,
        range_m: f64,
        pixel: [f64; 2],
        amplitude: Option<f64>,
        integration_time_s: Option<f64>,
    ) -> Result<f64> {
        let Some(set) = &self.models else { return Ok(range_m) };
        let models: Vec<InterpolatedModel> = match (integration_time_s, set.entries.as_slice()) {
            (_, [(_, models)]) => models.iter().cloned().map(InterpolatedModel::from).collect(),
            (Some(time), _) => set.at(time).map_err(|error| Error::Incompatible(error.to_string()))?,
            (None, _) => {
                let words = "the calibration has range models for several integration times, and observations.csv has none in \
                             `integration_time_s`";
                return Err(Error::Incompatible(words.to_owned()));
            }
        };
        let [model] = models.as_slice() else {
            let words =
                format!("the calibration has models for {} frequencies, observations.csv has one range", models.len());
            return Err(Error::Incompatible(words));
        };
        let [x, y] = self.camera.format.image_from_pixel(pixel);
        let [xp, yp] = self.camera.interior.principal_point_mm;
        let correction = model.correction(range_m, x - xp, y - yp, amplitude.unwrap_or(f64::NAN));
        Ok(if correction.outside_span { f64::NAN } else { range_m - correction.total_m() })
    }
}
