use range_image::{ComplexFrame, Flags};

use crate::{Psf, RestorationOptions, RestorationSummary, Restorer, Result};

/// Restores all frequencies of a frame in place; one summary for each.
///
/// Pixels without data and saturated ones keep their values and flags, and NaN does not spread. Pixels whose correction
/// depends strongly on light that is not known (see [`RestorationOptions::dependence_limit`]) are flagged: light that came
/// by more than one way is suspected in them. A frame in which one frequency fails stays as it was at that frequency and
/// those after it. For streams of frames keep a [`Restorer`].
pub fn restore(frame: &mut ComplexFrame, psf: &Psf, options: &RestorationOptions) -> Result<Vec<RestorationSummary>> {
    frame.validate()?;
    Restorer::new(psf, frame.width(), frame.height(), options)?.restore_frame(frame)
}

impl Restorer {
    /// Restores all frequencies of a frame in place, as [`restore`] does.
    pub fn restore_frame(&mut self, frame: &mut ComplexFrame) -> Result<Vec<RestorationSummary>> {
        let ComplexFrame { channels, flags } = frame;
        let mut summaries = Vec::with_capacity(channels.len());
        for channel in channels {
            summaries.push(self.restore_flagged(channel, flags)?);
            for &pixel in self.dependent_pixels() {
                flags.as_mut_slice()[pixel] |= Flags::MULTIPATH;
            }
        }
        Ok(summaries)
    }
}
