//! What the ranges that a calibration rests on have drifted by, as far as its start values know (Sect. 4.7).

use std::path::{Path, PathBuf};

use commands::plan::DriftTreatment;
use pipeline::survey::{DriftCurve, ViewDrift, view_name};
use pipeline::{Error, Result};
use range_io::calibration::Calibration;
use range_io::survey::Survey;

/// The drift of the start calibration's warming camera, or none.
pub(crate) struct KnownDrift<'a> {
    curve: Option<DriftCurve>,
    survey: &'a Survey,
    file: PathBuf,
}

impl<'a> KnownDrift<'a> {
    pub(crate) fn new(
        calibration: Option<&'a Calibration>,
        survey: &'a Survey,
        root: &Path,
        treatment: DriftTreatment,
    ) -> Result<Self> {
        let drift = calibration.and_then(|calibration| calibration.warm_up.as_ref());
        let drift = drift.filter(|_| treatment == DriftTreatment::Apply);
        let file = root.join(Survey::FILE_NAME);
        if drift.is_some() && survey.reference_path.is_some() {
            // What the reference shows depends on the terms that are to be found.
            let message = "has a `reference_path`, which takes the place of the calibrated drift and cannot be used \
                           before the range terms are known; calibrate the warm camera by `--warm-up leave`"
                .to_owned();
            return Err(Error::Survey { path: file, message });
        }
        let curve = drift
            .map(|drift| DriftCurve::new(drift, survey))
            .transpose()
            .map_err(Error::stage("calibrate", "start values"))?;
        Ok(Self { curve, survey, file })
    }

    /// The mean drift of some frames of a station; `None` where nothing is known to drift, or is to be taken off.
    pub(crate) fn of_frames(&self, station: &str, frames: &[usize]) -> Result<Option<ViewDrift>> {
        let Some(curve) = &self.curve else { return Ok(None) };
        if frames.is_empty() {
            let message = format!(
                "lists no frame of station `{station}`, whose time the drift of the warming camera depends on; add it \
                 or, where the camera was warm, calibrate by `--warm-up leave`"
            );
            return Err(Error::Survey { path: self.file.clone(), message });
        }
        let name = view_name(station, frames);
        let drift = curve.of_frames(name.clone(), frames, self.survey);
        drift.map(Some).map_err(Error::stage("calibrate", &name))
    }

    /// The same for all frames of a station.
    pub(crate) fn of_station(&self, station: &str) -> Result<Option<ViewDrift>> {
        let frames = self.survey.frames.iter().enumerate().filter(|(_, frame)| frame.station == station);
        self.of_frames(station, &frames.map(|(index, _)| index).collect::<Vec<_>>())
    }
}

/// What was taken off, in words; `None` where nothing was.
pub(crate) fn sentence(drifts: &[ViewDrift]) -> Option<String> {
    let extreme = |pick: fn(f64, f64) -> f64| drifts.iter().map(|drift| 1e3 * drift.drift_m).reduce(pick);
    let (low, high) = (extreme(f64::min)?, extreme(f64::max)?);
    let sigma = drifts.iter().map(|drift| 1e3 * drift.sigma_m).fold(0.0, f64::max);
    let known = if sigma > 0.0 {
        format!("known to {sigma:.2} mm, which the standard deviations do not have in them")
    } else {
        "taken as exact".to_owned()
    };
    Some(format!(
        "the drift of the warming camera is taken off the ranges: {low:.2} to {high:.2} mm at {} stations, {known}",
        drifts.len()
    ))
}
