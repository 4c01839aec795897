//! Start values: the survey's nominal camera, or a calibration.

pub(crate) mod conditions;
pub(crate) mod drift;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use camera_model::Camera;
use error_models::RangeErrorModel;
use pipeline::survey::{Purpose, ViewDrift, compatible, model_set, read_calibration};
use pipeline::{Error, Result};
use range_image::Modulation;
use range_io::calibration::Calibration;
use range_io::survey::{Level, Survey};

use crate::calibrate::start::conditions::Conditions;

/// What a calibration starts from and what it came from.
#[derive(Debug, Clone)]
pub(crate) struct Start {
    pub(crate) camera: Camera,
    pub(crate) range_model: RangeErrorModel,
    pub(crate) modulation: Modulation,
    /// The calibration that gave the values, in full: what is not estimated (noise, scattering) is handed on.
    pub(crate) calibration: Option<Calibration>,
    pub(crate) words: String,
    /// What the ranges of each station had drifted by, where that is taken off.
    pub(crate) drifts: Vec<ViewDrift>,
    /// Line of `observations.csv` of each station and target; empty where targets are not what is calibrated from.
    pub(crate) lines: BTreeMap<(String, String), usize>,
    /// Whether the camera gives light alone, so that there is no range model to write.
    pub(crate) light_alone: bool,
    /// The survey's description.
    pub(crate) survey_file: PathBuf,
    /// What it says of camera and conditions.
    pub(crate) conditions: Conditions,
}

impl Start {
    /// Keeps what was taken off, and says so.
    pub(crate) fn set_drifts(&mut self, drifts: Vec<ViewDrift>) {
        if let Some(sentence) = drift::sentence(&drifts) {
            self.words = format!("{}; {sentence}", self.words);
        }
        self.drifts = drifts;
    }

    /// Start values of a survey; `named` wins over the `calibration.ron` beside it.
    pub(crate) fn read(survey: &Survey, root: &Path, named: Option<&Path>) -> Result<Self> {
        let modulation = only_modulation(survey, root)?;
        let nominal = survey.camera.nominal_camera()?;
        let (calibration, words) = read_calibration(root, named)?;
        let words = if calibration.is_some() { words } else { "the survey's nominal camera".to_owned() };
        let camera = match &calibration {
            Some(calibration) => compatible(survey, calibration, Purpose::Camera)?.camera,
            None => nominal,
        };
        let range_model = match &calibration {
            Some(calibration) => range_model_of(survey, calibration, modulation)?,
            None => error_free(modulation),
        };
        Ok(Self {
            camera,
            range_model,
            modulation,
            calibration,
            words,
            drifts: Vec::new(),
            lines: BTreeMap::new(),
            light_alone: survey.level == Level::Intensity,
            survey_file: root.join(Survey::FILE_NAME),
            conditions: Conditions::of(survey),
        })
    }
}

/// Stands for the frequency of light that is not modulated.
const NO_FREQUENCY_HZ: f64 = 1.0;

/// The ranges of a table belong to one frequency: with several it would not be known to which.
fn only_modulation(survey: &Survey, root: &Path) -> Result<Modulation> {
    match survey.camera.modulations()?.as_slice() {
        [modulation] => Ok(*modulation),
        // Without ranges there are no range terms, and their frequency stands for nothing.
        [] if survey.level == Level::Intensity => {
            Modulation::new(NO_FREQUENCY_HZ).map_err(|error| Error::Camera(error.to_string()))
        }
        several => Err(Error::Survey {
            path: root.join(Survey::FILE_NAME),
            message: format!(
                "`camera.modulation_hz` has {} frequencies, expected one: \
                 each has range terms of its own and is calibrated by itself",
                several.len()
            ),
        }),
    }
}

fn error_free(modulation: Modulation) -> RangeErrorModel {
    RangeErrorModel::error_free(modulation.ambiguity_interval_m())
}

/// The model of the frequency at the shortest integration time; without one, no range error is known.
fn range_model_of(survey: &Survey, calibration: &Calibration, modulation: Modulation) -> Result<RangeErrorModel> {
    let models = model_set(survey, calibration)?.entries.into_iter().flat_map(|(_, models)| models).next();
    Ok(models.unwrap_or_else(|| error_free(modulation)))
}
