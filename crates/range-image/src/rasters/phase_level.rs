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
    /// [`Flags::NO_DATA`]. Nothing is known of the offset, and sigma is NaN until it is given by [`Self::with_sigma`] or
    /// predicted by [`ComplexChannel::predict_sigma`]; what weighs frequencies against each other needs it.
    ///
    /// Fails where there is no raster, where their number is not that of the modulations or their sizes differ, and where
    /// the offset of the convention is not finite.
    ///
    /// ```
    /// use range_image::{ComplexFrame, Modulation, PhaseConvention, Raster};
    ///
    /// let (phase, amplitude) = (Raster::filled(4, 3, -1.0), Raster::filled(4, 3, 250.0));
    /// let frame = ComplexFrame::from_phase(
    ///     vec![Modulation::new(20e6)?],
    ///     vec![phase],
    ///     vec![amplitude],
    ///     &PhaseConvention::default(),
    /// )?;
    /// let frame = frame.with_sigma(vec![Raster::filled(4, 3, 2.5)])?;
    /// let channel = &frame.channels[0];
    /// assert!((channel.phase()[(0, 0)] - 5.283_185).abs() < 1e-5, "in [0, 2 pi)");
    /// assert!((channel.sigma_phase()[(0, 0)] - 0.01).abs() < 1e-6);
    /// # Ok::<(), range_image::Error>(())
    /// ```
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

    /// The frame with the standard deviation of each part of `z`, one raster a channel, in the unit of the amplitudes; NaN
    /// where it is not known. For phases it is that of the phase in radians times the amplitude.
    ///
    /// Fails unless there is one raster of the frame's size for each channel.
    pub fn with_sigma(mut self, sigma: Vec<Raster<f32>>) -> Result<Self> {
        if sigma.len() != self.channels.len() {
            let expected = "there is one for each channel";
            return Err(Error::OutOfDomain { name: "sigma rasters", value: sigma.len() as f64, expected });
        }
        for (channel, sigma) in self.channels.iter_mut().zip(sigma) {
            channel.real.require_same_size(&sigma, "sigma")?;
            channel.sigma = sigma;
        }
        Ok(self)
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
