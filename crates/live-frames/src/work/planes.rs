//! From samples to phases, amplitudes and their noise.

use range_image::{ComplexFrame, Flags, Raster, RawView};

use crate::calibration::PreparedCalibration;
use crate::camera::LiveCamera;
use crate::error::{Error, Result};
use crate::frame::ProcessedFrame;

/// Planes between samples and ranges, kept from frame to frame.
#[derive(Debug)]
pub(crate) struct Planes {
    pub(crate) complex: ComplexFrame,
    pub(crate) phases: Vec<Raster<f32>>,
    /// Amplitudes of the frequencies after the first, whose are the frame's.
    pub(crate) further_amplitudes: Vec<Raster<f32>>,
    /// Standard deviations of the phases, radian; none for one frequency, whose ranges' are the frame's.
    pub(crate) sigmas: Vec<Raster<f32>>,
}

impl Planes {
    pub(crate) fn new(camera: &LiveCamera) -> Self {
        let plane = Raster::filled(camera.width, camera.height, f32::NAN);
        let count = camera.modulations.len();
        let several = if count > 1 { count } else { 0 };
        Self {
            complex: ComplexFrame::empty(),
            phases: vec![plane.clone(); count],
            further_amplitudes: vec![plane.clone(); count - 1],
            sigmas: vec![plane; several],
        }
    }

    /// Demodulates samples, takes scattered light off, and derives what unwrapping and correction work on.
    pub(crate) fn fill(
        &mut self,
        raw: &RawView<'_>,
        calibration: &mut PreparedCalibration,
        most_missing: f64,
        frame: &mut ProcessedFrame,
    ) -> Result<()> {
        let complex = &mut self.complex;
        calibration.demodulator.demodulate_view_into(raw, complex)?;
        let (missing, pixels) = (without_data(complex.flags.as_slice()), complex.flags.len());
        if missing as f64 > most_missing * pixels as f64 || missing == pixels {
            return Err(Error::Missing { missing, pixels, most: most_missing });
        }
        if let Some(scattering) = &mut calibration.scattering {
            scattering.restorer.restore_frame_with(complex, |_| ())?;
            if let Some(detector) = &scattering.outside {
                for channel in &complex.channels {
                    detector.detect(channel, &mut complex.flags)?;
                }
            }
        }
        let amplitudes = std::iter::once(&mut frame.amplitude).chain(&mut self.further_amplitudes);
        let planes = self.phases.iter_mut().zip(amplitudes);
        if let [channel] = complex.channels.as_slice() {
            let unit = channel.modulation.range_from_phase(1.0) as f32;
            for (phase, amplitude) in planes {
                channel.phase_amplitude_and_sigma_into(phase, amplitude, &mut frame.sigma, unit)?;
            }
        } else {
            for ((channel, (phase, amplitude)), sigma) in complex.channels.iter().zip(planes).zip(&mut self.sigmas) {
                channel.phase_amplitude_and_sigma_into(phase, amplitude, sigma, 1.0)?;
            }
        }
        Ok(())
    }
}

/// Number of pixels without data.
fn without_data(flags: &[Flags]) -> usize {
    // Counts of a block fit into the width of a flag, so that many are compared at once.
    let of_block = |block: &[Flags]| {
        let count = block.iter().fold(0_u16, |sum, flags| sum.wrapping_add(flags.bits() >> 7 & 1));
        usize::from(count)
    };
    flags.chunks(1 << 12).map(of_block).sum()
}
