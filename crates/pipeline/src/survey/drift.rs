//! What the ranges of a view have drifted by since the camera was switched on (Sect. 4.7).

use error_models::{RateHistory, WarmUp};
use nalgebra::{DMatrix, DVector};
use range_io::calibration::CalibratedDrift;
use range_io::survey::Survey;
use serde::Serialize;

use crate::survey::frame_rates::rate_history;
use crate::survey::view::View;
use commands::{DriftError, Tape};

/// The drift of a view, the same at all its pixels.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ViewDrift {
    /// Station, and frame or number of frames.
    pub view: String,
    /// What was subtracted from every range, metre.
    pub drift_m: f64,
    /// Its standard deviation, metre. It is common to all pixels of the view, so no mean over pixels makes it smaller;
    /// the standard deviations of the pixels do not have it in them.
    pub sigma_m: f64,
    /// Where it comes from.
    pub source: DriftSource,
    /// What of it follows the frame rate, where the calibration says so.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_rate: Option<FrameRatePart>,
}

/// The part of a drift that follows the frame rate.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct FrameRatePart {
    /// How much of the drift it is, metre.
    pub part_m: f64,
    /// Mean rate at the times of the frames, hertz.
    pub rate_hz: f64,
}

/// Where a drift comes from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DriftSource {
    /// The calibrated curve by time and temperature.
    #[default]
    Calibration,
    /// The camera's optical reference.
    ReferencePath,
}

impl ViewDrift {
    /// Writes it, or takes it over.
    pub(crate) fn carry(&mut self, tape: &mut Tape) {
        tape.text(&mut self.view);
        for number in [&mut self.drift_m, &mut self.sigma_m] {
            tape.number(number);
        }
        let mut by_reference = self.source == DriftSource::ReferencePath;
        tape.flag(&mut by_reference);
        self.source = if by_reference { DriftSource::ReferencePath } else { DriftSource::Calibration };
        tape.option(&mut self.frame_rate, FrameRatePart::default, |tape, part| {
            for number in [&mut part.part_m, &mut part.rate_hz] {
                tape.number(number);
            }
        });
    }
}

/// A calibrated drift, ready for views of a survey.
pub struct DriftCurve {
    model: WarmUp,
    covariance: DMatrix<f64>,
    /// Where the drift follows them.
    rates: Option<RateHistory>,
}

impl DriftCurve {
    /// The curve of a calibration for the frames of a survey.
    pub fn new(calibrated: &CalibratedDrift, survey: &Survey) -> Result<Self, DriftError> {
        let model = &calibrated.model;
        let known_from_s = model.time_span_s.map_or(0.0, |span| span[0]);
        let rates = model.frame_rate.map(|_| rate_history(survey, power_on_s(survey)?, known_from_s));
        Ok(Self { model: model.clone(), covariance: calibrated.covariance()?, rates: rates.transpose()? })
    }

    /// The mean of the drifts of the frames that went into a view.
    pub fn of_view(&self, view: &View, survey: &Survey) -> Result<ViewDrift, DriftError> {
        self.of_frames(view.name(), &view.frames, survey)
    }

    /// The mean of the drifts of frames, by their positions in the survey.
    pub fn of_frames(&self, view: String, frames: &[usize], survey: &Survey) -> Result<ViewDrift, DriftError> {
        let (mut drift_m, mut row) = (0.0, DVector::zeros(self.covariance.nrows()));
        let (mut rate, mut unknown_m) = (FrameRatePart { part_m: 0.0, rate_hz: 0.0 }, 0.0);
        let share = 1.0 / frames.len().max(1) as f64;
        for &frame in frames {
            let time_s = self.time(survey, frame)?;
            let temperature_c = self.temperature(survey, frame)?;
            let refused = |source| match source {
                error_models::Error::UnknownFrameRate { .. } => DriftError::UnknownRate { frame, source },
                source => DriftError::Outside { frame, source },
            };
            let rates = self.rates.as_ref();
            drift_m += share * self.model.value_at_rates(time_s, temperature_c, rates).map_err(refused)?;
            let derivatives = self.model.jacobian_at_rates(time_s, temperature_c, rates).map_err(refused)?;
            row += share * DVector::from_vec(derivatives);
            if let (Some(part), Some(rates), Some(time_s)) = (self.model.frame_rate, rates, time_s) {
                rate.part_m += share * part.value(time_s, rates);
                rate.rate_hz += share * rates.rate_hz(time_s);
                unknown_m += share * part.unknown_sigma_m(time_s, rates);
            }
        }
        // The errors of the parameters are the same in all frames: derivatives are averaged, not variances.
        let sigma_m = row.dot(&(&self.covariance * &row)).max(0.0).sqrt().hypot(unknown_m);
        let frame_rate = self.rates.as_ref().map(|_| rate);
        Ok(ViewDrift { view, drift_m, sigma_m, source: DriftSource::Calibration, frame_rate })
    }

    /// Time since power-on; `None` where the drift does not depend on it.
    fn time(&self, survey: &Survey, frame: usize) -> Result<Option<f64>, DriftError> {
        if self.model.transients.is_empty() && self.model.frame_rate.is_none() {
            return Ok(None);
        }
        let power_on_s = power_on_s(survey)?;
        let time_s = survey.frames.get(frame).and_then(|entry| entry.timestamp_s);
        Ok(Some(time_s.ok_or_else(|| missing_time(format!("frames[{frame}].timestamp_s")))? - power_on_s))
    }

    /// Temperature of the camera; `None` where the drift does not depend on it.
    fn temperature(&self, survey: &Survey, frame: usize) -> Result<Option<f64>, DriftError> {
        if self.model.temperature.is_none() {
            return Ok(None);
        }
        let temperature_c = survey.frames.get(frame).and_then(|entry| entry.temperature_c);
        let field = format!("frames[{frame}].temperature_c");
        temperature_c.map(Some).ok_or(DriftError::Missing { quantity: "the camera's temperature", field })
    }
}

fn power_on_s(survey: &Survey) -> Result<f64, DriftError> {
    survey.power_on_s.ok_or_else(|| missing_time("power_on_s".to_owned()))
}

fn missing_time(field: String) -> DriftError {
    DriftError::Missing { quantity: "the time since power-on", field }
}
