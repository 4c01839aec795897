//! Two surveys as pairs of averaged complex images.

use std::path::Path;

use commands::Progress;
use pipeline::run::Processed;
use pipeline::survey::ViewData;
use pipeline::{AverageOptions, DemodulateOptions, Error, Plan, Result, Stage, process};
use range_image::ComplexFrame;
use range_io::calibration::Calibration;
use range_io::survey::{Level, Survey};
use scattering_deconvolution::{EstimationOptions, ForegroundCapture, Psf};

use crate::further_term::start;
use crate::scattering::ScatteringRequest;
use crate::scattering::shifts::{Shift, shifts_of};

/// One scene from all stations, with and without objects.
pub(crate) struct Captures {
    pub(crate) stations: Vec<String>,
    pub(crate) calibration: Calibration,
    pub(crate) calibration_words: String,
    with_object: Processed,
    /// For each view with an object the one of the same station without.
    without_object: Vec<ComplexFrame>,
}

impl Captures {
    /// Demodulates and averages both surveys and pairs their stations by name.
    pub(crate) fn read(request: &ScatteringRequest, progress: &dyn Progress) -> Result<Self> {
        let (calibration, calibration_words) = start(&request.without_object, request.calibration.as_deref())?;
        let with_object = frames(&request.with_object, request.calibration.as_deref(), progress)?;
        let mut others = frames(&request.without_object, request.calibration.as_deref(), progress)?;
        let known: Vec<String> = others.views.iter().map(|other| other.station.clone()).collect();
        let mut stations = Vec::new();
        let mut without_object = Vec::new();
        for view in &with_object.views {
            complex(view)?;
            let Some(place) = others.views.iter().position(|other| other.station == view.station) else {
                let message = format!(
                    "it has no station `{}`, which {} has: {}",
                    view.station,
                    request.with_object.display(),
                    known.join(", ")
                );
                return Err(Error::Survey { path: request.without_object.clone(), message });
            };
            let other = others.views.swap_remove(place);
            complex(&other)?;
            let ViewData::Phase(frame) = other.data else { continue };
            without_object.push(frame);
            stations.push(view.station.clone());
        }
        Ok(Self { stations, calibration, calibration_words, with_object, without_object })
    }

    /// What the estimation takes.
    pub(crate) fn pairs(&self) -> Vec<ForegroundCapture<'_>> {
        let with_object = self.with_object.views.iter().filter_map(|view| match &view.data {
            ViewData::Phase(frame) => Some(frame),
            _ => None,
        });
        let pair = |(with_object, without_object)| ForegroundCapture { with_object, without_object, object: None };
        with_object.zip(&self.without_object).map(pair).collect()
    }

    /// How far the object's scattered light moves the background's ranges, as observed and as restored.
    pub(crate) fn shifts(&self, psf: &Psf, options: &EstimationOptions) -> Result<Vec<Shift>> {
        let pairs = self.pairs();
        self.stations.iter().zip(&pairs).map(|(station, pair)| shifts_of(station, pair, psf, options)).collect()
    }
}

/// A survey's frames, one complex image a station.
fn frames(survey: &Path, calibration: Option<&Path>, progress: &dyn Progress) -> Result<Processed> {
    let level = Survey::read(survey)?.level;
    if level > Level::Phase {
        let (stage, needs) = ("scattering", Level::Phase.name());
        return Err(Error::RuledOut { stage, needs, level: level.name() });
    }
    let mut stages = Vec::new();
    if level == Level::Samples {
        stages.push(Stage::Demodulate(DemodulateOptions::default()));
    }
    stages.push(Stage::Average(AverageOptions::default()));
    let plan = Plan { name: "scattering".to_owned(), source: None, calibrate: None, stages };
    process(&plan, survey, calibration, progress)
}

fn complex(view: &pipeline::View) -> Result<()> {
    match view.data {
        ViewData::Phase(_) => Ok(()),
        _ => Err(Error::Needs { stage: "scattering", needs: "Demodulate" }),
    }
}
