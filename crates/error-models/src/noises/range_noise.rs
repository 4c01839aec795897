//! The random error of a range from the amplitude alone, for cameras that deliver no samples.

use std::f64::consts::TAU;

use range_image::{ComplexFrame, RangeFrame};

use crate::{Error, Result};

/// What a camera shows as amplitude.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum AmplitudeScale {
    /// The light that it received.
    #[default]
    AsReceived,
    /// That light times the squared range, so that surfaces look equally bright at all distances.
    TimesSquaredRange,
    /// None. One over the squared range (metre) stands for the light, so that `σ = s ρ²`: so the ranges of structured light
    /// and of stereo scatter, and those of white surfaces alike in a camera that shows no amplitudes.
    InverseSquaredRange,
}

/// Standard deviation of a range as a function of the received amplitude: `σ² = (s / a)² + floor²`.
///
/// The first part is `σ_ρ = U / 2π · σ_z / A` (`[Lange2000]`) with a noise of the samples that does not change; the
/// floor is what more light does not reduce.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct RangeNoise {
    /// s: standard deviation times received amplitude, metre times the camera's amplitude unit (of an amplitude times
    /// squared range: at one metre).
    pub sigma_times_amplitude_m: f64,
    /// Standard deviation in endless light, metre.
    pub floor_m: f64,
    /// What the camera shows as amplitude.
    #[cfg_attr(feature = "serde", serde(default))]
    pub amplitude_scale: AmplitudeScale,
    /// What neighbouring pixels have in common of it; `None`: nothing.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub shared: Option<SharedNoise>,
}

/// Noise that the pixels of a neighbourhood have in common, as where a camera finds each range from a window of pixels, or smooths
/// its ranges: a mean over neighbours does not remove it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct SharedNoise {
    /// Part of a pixel's variance, 0 to 1.
    pub share: f64,
    /// Width of a neighbourhood, pixel: at this distance pixels have nothing in common.
    pub width_px: f64,
}

impl AmplitudeScale {
    /// The received amplitude behind the one shown at a range in metre.
    pub fn received(self, amplitude: f64, range_m: f64) -> f64 {
        match self {
            Self::AsReceived => amplitude,
            Self::TimesSquaredRange => amplitude / (range_m * range_m),
            Self::InverseSquaredRange => 1.0 / (range_m * range_m),
        }
    }
}

impl RangeNoise {
    /// Refuses parts that are negative or not finite, and a model without any noise.
    pub fn validate(&self) -> Result<()> {
        for (name, value) in [("sigma_times_amplitude_m", self.sigma_times_amplitude_m), ("floor_m", self.floor_m)] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(Error::OutOfDomain { name, value, expected: "noise is finite and not negative" });
            }
        }
        if let Some(shared) = self.shared {
            if !(0.0..=1.0).contains(&shared.share) {
                let expected = "a share lies between 0 and 1";
                return Err(Error::OutOfDomain { name: "share", value: shared.share, expected });
            }
            if !(shared.width_px.is_finite() && shared.width_px >= 1.0) {
                let expected = "a neighbourhood is at least one pixel wide";
                return Err(Error::OutOfDomain { name: "width_px", value: shared.width_px, expected });
            }
        }
        if self.sigma_times_amplitude_m + self.floor_m > 0.0 {
            return Ok(());
        }
        Err(Error::OutOfDomain { name: "floor_m", value: 0.0, expected: "some noise" })
    }

    /// Standard deviation in metre of a range with the amplitude that the camera shows; NaN where that is not positive.
    pub fn sigma_m(&self, amplitude: f64, range_m: f64) -> f64 {
        let received = self.amplitude_scale.received(amplitude, range_m);
        if received > 0.0 { (self.sigma_times_amplitude_m / received).hypot(self.floor_m) } else { f64::NAN }
    }

    /// Gives a standard deviation to each pixel of a frame that has a range and none of its own.
    pub fn predict_sigma(&self, frame: &mut RangeFrame) -> Result<()> {
        self.validate()?;
        frame.validate()?;
        let pixels = frame.range.as_slice().iter().zip(frame.amplitude.as_slice());
        for (sigma, (range, amplitude)) in frame.sigma.as_mut_slice().iter_mut().zip(pixels) {
            if sigma.is_nan() && range.is_finite() {
                *sigma = self.sigma_m(f64::from(*amplitude), f64::from(*range)) as f32;
            }
        }
        Ok(())
    }

    /// The same for the complex image of one frequency, whose amplitude is as received: `σ_z = 2π / U · a σ_ρ`.
    pub fn predict_complex_sigma(&self, frame: &mut ComplexFrame) -> Result<()> {
        self.validate()?;
        frame.validate()?;
        let received = Self { amplitude_scale: AmplitudeScale::AsReceived, ..*self };
        for channel in &mut frame.channels {
            let radians = TAU / channel.modulation.ambiguity_interval_m();
            let parts = channel.real.as_slice().iter().zip(channel.imaginary.as_slice());
            for (sigma, (re, im)) in channel.sigma.as_mut_slice().iter_mut().zip(parts) {
                let amplitude = f64::from(*re).hypot(f64::from(*im));
                if sigma.is_nan() {
                    *sigma = (radians * amplitude * received.sigma_m(amplitude, 1.0)) as f32;
                }
            }
        }
        Ok(())
    }
}
