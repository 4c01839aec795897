//! What the calibrated drift says of the camera's state.

use std::fmt;

use range_io::error_models::WarmUp;
use serde::Serialize;

use crate::wire::FrameHeader;

/// Drift that may still come before the camera counts as warm, metre: a tenth of what a good range camera scatters by.
const STILL_TO_COME_M: f64 = 0.001;

/// Whether a calibrated drift holds for a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum DriftVerdict {
    /// The calibration has none.
    #[default]
    NotCalibrated,
    /// Time and temperature lie in the span that it was fitted in, and less than a millimetre of warming up is to come.
    Warm,
    /// They lie in the span, and the camera is warming up.
    WarmingUp,
    /// They lie outside of it.
    Outside,
    /// The frame does not state what it depends on.
    Unstated,
}

/// What the calibrated drift says of the last frame.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct DriftReport {
    /// Whether it holds.
    pub verdict: DriftVerdict,
    /// The drift, metre, where it holds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drift_m: Option<f64>,
    /// Why it does not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub words: Option<String>,
}

impl DriftReport {
    /// The report on a frame of a camera that was switched on at a time.
    pub(super) fn of(model: Option<&WarmUp>, power_on_s: Option<f64>, header: &FrameHeader) -> Self {
        let Some(model) = model else { return Self::default() };
        let time_s = power_on_s.map(|power_on_s| header.timestamp_s - power_on_s);
        let unstated = |words: &str| Self {
            verdict: DriftVerdict::Unstated,
            drift_m: None,
            words: Some(format!("{words} is not stated")),
        };
        if time_s.is_none() && !model.transients.is_empty() {
            return unstated("the time of power-on");
        }
        if header.temperature_c.is_none() && model.temperature.is_some() {
            return unstated("the camera's temperature");
        }
        match model.value(time_s, header.temperature_c) {
            Ok(drift_m) => {
                let is_warm = time_s.is_none_or(|time_s| time_s >= model.settling_time_s(STILL_TO_COME_M));
                let verdict = if is_warm { DriftVerdict::Warm } else { DriftVerdict::WarmingUp };
                Self { verdict, drift_m: Some(drift_m), words: None }
            }
            Err(error) => Self { verdict: DriftVerdict::Outside, drift_m: None, words: Some(error.to_string()) },
        }
    }
}

impl fmt::Display for DriftReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.verdict, self.drift_m, &self.words) {
            (DriftVerdict::NotCalibrated, ..) => f.write_str("drift not calibrated"),
            (DriftVerdict::WarmingUp, Some(drift_m), _) => write!(f, "warming up, drift {:.1} mm", 1e3 * drift_m),
            (_, Some(drift_m), _) => write!(f, "warm, drift {:.1} mm", 1e3 * drift_m),
            (DriftVerdict::Unstated, _, Some(words)) => write!(f, "drift not known: {words}"),
            (_, _, words) => write!(f, "outside of the calibrated drift: {}", words.as_deref().unwrap_or_default()),
        }
    }
}
