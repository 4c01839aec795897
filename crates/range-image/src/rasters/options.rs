//! What has to be known of a camera to demodulate its samples.

use crate::{Error, NoiseModel, PhaseConvention, PhaseSense, Result};

/// What the camera means by its samples, and what is known of their noise.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct DemodulationOptions {
    /// Whether the samples step forward or backward in phase. Default: [`PhaseSense::Positive`].
    pub phase_sense: PhaseSense,
    /// Added to the phase after the sense is applied, radian. Default: 0 rad.
    pub phase_offset_rad: f64,
    /// Samples are multiplied by it; amplitude, offset and sigma come out in the scaled unit. Default: 1.
    pub raw_scale: f64,
    /// A sample at or above it (in absolute value) flags its pixel as saturated; raw units, before the scale. Default:
    /// `None`.
    pub saturation: Option<f64>,
    /// Noise of a sample in the scaled unit. Default: that of [`NoiseModel`].
    pub noise: NoiseModel,
    /// Pixels with a smaller amplitude at any frequency are flagged; scaled unit. Default: `None`.
    pub low_amplitude: Option<f64>,
}

impl Default for DemodulationOptions {
    /// The samples of the conventions, unscaled, nothing known of saturation and noise.
    fn default() -> Self {
        Self {
            phase_sense: PhaseSense::Positive,
            phase_offset_rad: 0.0,
            raw_scale: 1.0,
            saturation: None,
            noise: NoiseModel::default(),
            low_amplitude: None,
        }
    }
}

impl DemodulationOptions {
    /// The phase convention among the options.
    pub fn phase_convention(&self) -> PhaseConvention {
        PhaseConvention { phase_sense: self.phase_sense, phase_offset_rad: self.phase_offset_rad }
    }

    /// Fails on a value that no camera can have.
    pub fn validate(&self) -> Result<()> {
        self.phase_convention().validate()?;
        self.noise.validate()?;
        require_positive("raw_scale", self.raw_scale)?;
        for (name, value) in [("saturation", self.saturation), ("low_amplitude", self.low_amplitude)] {
            value.map_or(Ok(()), |value| require_positive(name, value))?;
        }
        Ok(())
    }
}

fn require_positive(name: &'static str, value: f64) -> Result<()> {
    // Planes are f32: what underflows or overflows there is no scale.
    let single = value as f32;
    if single.is_normal() && single > 0.0 {
        return Ok(());
    }
    Err(Error::OutOfDomain { name, value, expected: "must be positive and within the range of f32" })
}
