//! Frames whose scattered light is found at once and taken off row by row, by those who work through them that way.

use range_image::{ComplexFrame, Flags};

use crate::kernels::interpolation::Lines;
use crate::restoration::restorer::MODULATIONS;
use crate::restoration::work::Work;
use crate::{RestorationSummary, Restorer, Result};

/// Scattered light of one channel that is found and still to be taken off.
#[derive(Default)]
pub(crate) struct Left {
    lines: Lines,
    /// Which operators found it; none where nothing is left.
    pub(crate) work: Option<usize>,
    /// Factor of the standard deviations.
    pub(crate) gain: f32,
}

/// A row of a channel.
#[derive(Debug)]
pub struct ChannelRow<'a> {
    /// Real part.
    pub real: &'a mut [f32],
    /// Imaginary part.
    pub imaginary: &'a mut [f32],
    /// Standard deviation of each part.
    pub sigma: &'a mut [f32],
}

impl Work {
    /// Leaves the scattered light to be taken off row by row.
    pub(crate) fn leave(&mut self, left: &mut Left) {
        let Self { grid, scattered, .. } = self;
        grid.leave_lines(scattered, -1.0, &mut left.lines);
    }
}

impl Restorer {
    /// As [`Self::restore_frame_with`], but a channel in which nothing is put aside stays as it is until [`Self::take_off_row`]
    /// restores its rows, to the same bits.
    pub fn find_in_frame(&mut self, frame: &mut ComplexFrame, mut told: impl FnMut(RestorationSummary)) -> Result<()> {
        let ComplexFrame { channels, flags } = frame;
        if channels.len() >= MODULATIONS {
            return self.restore_frame_with(frame, told);
        }
        self.left.iter_mut().for_each(|left| left.work = None);
        self.left.resize_with(channels.len().max(self.left.len()), Left::default);
        for (index, channel) in channels.iter_mut().enumerate() {
            let mut left = std::mem::take(&mut self.left[index]);
            let found = self.restore_or_leave(channel, flags, &mut left);
            self.left[index] = left;
            told(found?);
            for &pixel in self.dependent_pixels() {
                flags.as_mut_slice()[pixel] |= Flags::MULTIPATH;
            }
        }
        Ok(())
    }

    /// Restores one row of the channel at an index of the last frame given to [`Self::find_in_frame`], or a copy of it; one that is
    /// restored already, and slices that are no rows of the image, stay as they are.
    pub fn take_off_row(&self, channel: usize, row: usize, pixels: ChannelRow<'_>) {
        let ChannelRow { real, imaginary, sigma } = pixels;
        let Some(left) = self.left.get(channel) else { return };
        let Some((_, work)) = left.work.and_then(|index| self.works.get(index)) else { return };
        let [width, height] = self.size;
        if row >= height || [real.len(), imaginary.len(), sigma.len()] != [width; 3] {
            return;
        }
        work.grid.add_row(&left.lines, row, [real, imaginary]);
        for sigma in sigma {
            *sigma *= left.gain;
        }
    }
}
