use range_image::Raster;

use crate::tree::forest::Forest;
use crate::tree::grid::Grid;

/// Wrap counts of one image.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Unwrapped {
    /// Whole cycles to add to the phase, `unwrapped = phase + 2 pi wraps`; 0 where masked.
    pub wraps: Raster<i32>,
    /// 0 (a guess, or masked) to 1 (certain).
    pub confidence: Raster<f32>,
    /// Island of each pixel: 0 where masked, else 1 + index into `islands`. Pixels of one island hang together by
    /// their sides.
    pub island: Raster<u32>,
    /// Segment of each pixel as the island was cut at possible jumps: 0 where masked, else from 1.
    pub segment: Raster<u32>,
    /// The islands.
    pub islands: Vec<Island>,
    /// Amplitude of a typical surface at a range of one ambiguity interval, where amplitudes decided the counts.
    pub typical_amplitude_at_interval: Option<f32>,
}

/// A connected part of the mask.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Island {
    /// Number of pixels.
    pub pixels: usize,
    /// Pixels whose confidence reaches the minimum of the options.
    pub sure_pixels: usize,
    /// Whether counts are absolute: a seed or amplitudes fixed them, and more than half of the pixels are sure.
    /// Otherwise they are relative, the lowest being 0 (without amplitudes) or a best guess (with).
    pub offset_known: bool,
    /// Segments that the island was cut into at possible jumps.
    pub segments: usize,
}

impl Unwrapped {
    /// Counts each island's pixels and takes the word `known` back where most are not sure.
    pub(crate) fn count_pixels(&mut self, minimum_confidence: f32) {
        for (&label, confidence) in self.island.as_slice().iter().zip(self.confidence.as_mut_slice()) {
            match self.islands.get_mut((label as usize).wrapping_sub(1)) {
                None => *confidence = 0.0,
                Some(island) => {
                    island.pixels += 1;
                    island.sure_pixels += usize::from(*confidence >= minimum_confidence);
                }
            }
        }
        for island in &mut self.islands {
            island.offset_known &= 2 * island.sure_pixels > island.pixels;
        }
    }

    /// Pixels that are masked or whose confidence is below `minimum_confidence`.
    pub fn unsure(&self, minimum_confidence: f32) -> Raster<bool> {
        let mut unsure = self.confidence.map(|&confidence| confidence < minimum_confidence);
        for (unsure, &island) in unsure.as_mut_slice().iter_mut().zip(self.island.as_slice()) {
            *unsure |= island == 0;
        }
        unsure
    }
}

/// Writes the labels of the forest into a raster: 0 where there is none, else from 1.
pub(crate) fn labels_from_one(grid: &Grid, forest: &Forest, raster: &mut Raster<u32>) {
    // No label is the largest number, which wraps to zero.
    grid.crop(&forest.label, raster, |&label| label.wrapping_add(1));
}
