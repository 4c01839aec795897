use range_image::{ComplexFrame, Flags};

use crate::{Psf, RestorationOptions, RestorationSummary, Restorer, Result};

/// Restores all frequencies of a frame in place; one summary for each.
///
/// Pixels without data and saturated ones keep their values and flags, and NaN does not spread. Pixels whose correction
/// depends strongly on light that is not known (see [`RestorationOptions::dependence_limit`]) are flagged: light that came
/// by more than one way is suspected in them. A frame in which one frequency fails stays as it was at that frequency and
/// those after it. For streams of frames keep a [`Restorer`].
///
/// # Errors
/// A point spread function or options that [`Restorer::new`] refuses, and an image that has not come below the tolerance.
///
/// ```
/// use scattering_deconvolution::range_image::{ComplexFrame, Modulation, PhaseConvention, Raster};
/// use scattering_deconvolution::{GaussianTerm, Psf, RestorationOptions, restore};
///
/// // A wall at 3 m, 20 MHz, and a lens that spreads 4 % of the light over 20 pixels.
/// let modulation = Modulation::new(20e6)?;
/// let phase = Raster::filled(64, 48, modulation.phase_from_range(3.0) as f32);
/// let amplitude = vec![Raster::filled(64, 48, 100.0)];
/// let mut frame = ComplexFrame::from_phase(vec![modulation], vec![phase], amplitude, &PhaseConvention::default())?;
/// let psf = Psf::Gaussians(vec![GaussianTerm { weight: 0.04, sigma_px: [20.0, 20.0] }]);
/// let summaries = restore(&mut frame, &psf, &RestorationOptions::default())?;
/// assert!(summaries[0].residual < 1e-5);
/// assert!(frame.channels[0].amplitude()[(32, 24)] < 100.0, "part of the light was scattered there");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn restore(frame: &mut ComplexFrame, psf: &Psf, options: &RestorationOptions) -> Result<Vec<RestorationSummary>> {
    frame.validate()?;
    Restorer::new(psf, frame.width(), frame.height(), options)?.restore_frame(frame)
}

impl Restorer {
    /// Restores all frequencies of a frame in place, as [`restore`] does.
    pub fn restore_frame(&mut self, frame: &mut ComplexFrame) -> Result<Vec<RestorationSummary>> {
        let mut summaries = Vec::with_capacity(frame.channels.len());
        self.restore_frame_with(frame, |summary| summaries.push(summary))?;
        Ok(summaries)
    }

    /// As [`Self::restore_frame`], each summary told as it comes: allocates nothing after the first frame.
    pub fn restore_frame_with(
        &mut self,
        frame: &mut ComplexFrame,
        mut told: impl FnMut(RestorationSummary),
    ) -> Result<()> {
        let ComplexFrame { channels, flags } = frame;
        self.left.iter_mut().for_each(|left| left.work = None);
        for channel in channels {
            told(self.restore_flagged(channel, flags)?);
            for &pixel in self.dependent_pixels() {
                flags.as_mut_slice()[pixel] |= Flags::MULTIPATH;
            }
        }
        Ok(())
    }
}
