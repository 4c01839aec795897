//! Frames whose phase and amplitude the camera computed itself.

use std::f64::consts::TAU;

use crate::{ComplexChannel, ComplexFrame, Error, Flags, Modulation, Raster, Result};

/// Direction in which the phase of a camera runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum PhaseSense {
    /// The phase grows with the range; samples are `B + A cos(phi + theta_n)`.
    #[default]
    Positive,
    /// The phase falls with the range; samples are `B + A cos(phi - theta_n)` in terms of the growing phase.
    Negative,
}

/// How a camera's phase becomes the phase of the conventions: `phi = +-phi_camera + offset`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct PhaseConvention {
    /// Direction of the camera's phase.
    pub phase_sense: PhaseSense,
    /// Added to the phase after the sense is applied, radian.
    pub phase_offset_rad: f64,
}

impl PhaseConvention {
    /// Fails unless the offset is finite.
    pub fn validate(&self) -> Result<()> {
        if self.phase_offset_rad.is_finite() {
            return Ok(());
        }
        Err(Error::OutOfDomain {
            name: "phase_offset_rad",
            value: self.phase_offset_rad,
            expected: "a phase offset is finite",
        })
    }

    /// Phase in the conventions' sense, in `[0, 2 pi)`.
    pub fn phase_from_camera(&self, camera_phase_rad: f64) -> f64 {
        let phase = match self.phase_sense {
            PhaseSense::Positive => camera_phase_rad,
            PhaseSense::Negative => -camera_phase_rad,
        };
        let wrapped = (phase + self.phase_offset_rad).rem_euclid(TAU);
        if wrapped < TAU { wrapped } else { 0.0 }
    }
}

impl ComplexFrame {
    /// Makes complex images from phases in radian and amplitudes, one raster of each a frequency (level `phase`).
    ///
    /// A pixel whose phase or amplitude is not finite, or whose amplitude is negative, gets `z` = NaN and
    /// [`Flags::NO_DATA`]. Nothing is known of offset and sigma (see [`ComplexChannel::predict_sigma`]).
    pub fn from_phase(
        modulations: Vec<Modulation>,
        phase: Vec<Raster<f32>>,
        amplitude: Vec<Raster<f32>>,
        convention: &PhaseConvention,
    ) -> Result<Self> {
        convention.validate()?;
        let Some(first) = phase.first() else { return Err(Error::NoFrames { what: "phase images" }) };
        let (width, height) = (first.width(), first.height());
        for (name, found) in [("phase rasters", phase.len()), ("amplitude rasters", amplitude.len())] {
            if found != modulations.len() {
                let expected = "there is one for each modulation frequency";
                return Err(Error::OutOfDomain { name, value: found as f64, expected });
            }
        }
        for (phase, amplitude) in phase.iter().zip(&amplitude) {
            first.require_same_size(phase, "phase")?;
            first.require_same_size(amplitude, "amplitude")?;
        }
        let mut flags = Raster::filled(width, height, Flags::empty());
        let rasters = phase.into_iter().zip(amplitude);
        let channels = modulations
            .into_iter()
            .zip(rasters)
            .map(|(modulation, (phase, amplitude))| channel(modulation, phase, amplitude, convention, &mut flags))
            .collect();
        Ok(Self { channels, flags })
    }
}

/// Turns phase and amplitude into real and imaginary part in place.
fn channel(
    modulation: Modulation,
    mut phase: Raster<f32>,
    mut amplitude: Raster<f32>,
    convention: &PhaseConvention,
    flags: &mut Raster<Flags>,
) -> ComplexChannel {
    let sigma = phase.map(|_| f32::NAN);
    let pixels = phase.as_mut_slice().iter_mut().zip(amplitude.as_mut_slice()).zip(flags.as_mut_slice());
    for ((phase, amplitude), flags) in pixels {
        if phase.is_finite() && amplitude.is_finite() && *amplitude >= 0.0 {
            let (sin, cos) = convention.phase_from_camera(f64::from(*phase)).sin_cos();
            let size = f64::from(*amplitude);
            (*phase, *amplitude) = ((size * cos) as f32, (size * sin) as f32);
        } else {
            (*phase, *amplitude) = (f32::NAN, f32::NAN);
            *flags |= Flags::NO_DATA;
        }
    }
    ComplexChannel { modulation, real: phase, imaginary: amplitude, offset: None, sigma }
}
