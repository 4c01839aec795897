use range_image::ComplexFrame;

use crate::{Psf, RestorationOptions, RestorationSummary, Restorer, Result};

/// Restores all frequencies of a frame in place; one summary for each.
///
/// Pixels without data and saturated ones keep their values and flags, and NaN does not spread. A frame in which one
/// frequency fails stays as it was at that frequency and those after it. For streams of frames keep a [`Restorer`].
pub fn restore(frame: &mut ComplexFrame, psf: &Psf, options: &RestorationOptions) -> Result<Vec<RestorationSummary>> {
    frame.validate()?;
    Restorer::new(psf, frame.width(), frame.height(), options)?.restore_frame(frame)
}

impl Restorer {
    /// Restores all frequencies of a frame in place, as [`restore`] does.
    pub fn restore_frame(&mut self, frame: &mut ComplexFrame) -> Result<Vec<RestorationSummary>> {
        let ComplexFrame { channels, flags } = frame;
        channels.iter_mut().map(|channel| self.restore_flagged(channel, flags)).collect()
    }
}
