//! Mean changes of range, one a frame.

use crate::options::DriftOptions;
use crate::{DriftError, DriftResult, TemperatureUse};

/// By how much the ranges of a scene at rest have changed in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriftSample {
    /// Time since power-on, second.
    pub time_s: f64,
    /// Mean change of the ranges against any fixed reference, metre.
    pub mean_change_m: f64,
    /// Its standard deviation, metre; a common factor of all does not matter.
    pub sigma_m: f64,
    /// Temperature of the camera, degree Celsius.
    pub temperature_c: Option<f64>,
}

/// Refuses samples that are no numbers, times that do not ascend, and short captures.
pub(crate) fn check(samples: &[DriftSample], options: &DriftOptions) -> DriftResult<()> {
    for (index, sample) in samples.iter().enumerate() {
        sample.check(index)?;
        if options.temperature == TemperatureUse::Estimate && sample.temperature_c.is_none() {
            return Err(DriftError::MissingTemperature { index });
        }
    }
    if let Some(index) = (1..samples.len()).find(|&index| samples[index].time_s <= samples[index - 1].time_s) {
        let (time_s, before_s) = (samples[index].time_s, samples[index - 1].time_s);
        return Err(DriftError::NotAscending { index, time_s, before_s });
    }
    let needed = DriftOptions::LEAST_BLOCKS;
    let too_few = DriftError::TooFewBlocks { blocks: samples.len(), needed };
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return Err(too_few) };
    let (duration_s, needed_s) = (last.time_s - first.time_s, options.least_duration_s);
    if duration_s < needed_s {
        return Err(DriftError::CaptureTooShort { duration_s, needed_s });
    }
    if samples.len() < needed {
        return Err(too_few);
    }
    Ok(())
}

impl DriftSample {
    fn check(&self, index: usize) -> DriftResult<()> {
        let sigma = self.sigma_m.is_finite() && self.sigma_m > 0.0;
        let temperature_c = self.temperature_c.unwrap_or(0.0);
        for (name, value, holds, expected) in [
            ("time since power-on", self.time_s, self.time_s.is_finite() && self.time_s >= 0.0, "a time not negative"),
            ("mean change", self.mean_change_m, self.mean_change_m.is_finite(), "a finite length"),
            ("standard deviation", self.sigma_m, sigma, "a positive length"),
            ("temperature", temperature_c, temperature_c.is_finite(), "a finite temperature"),
        ] {
            if !holds {
                return Err(DriftError::BadSample { index, name, value, expected });
            }
        }
        Ok(())
    }
}
