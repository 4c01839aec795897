use range_image::Raster;

/// Wrap counts of one image.
#[derive(Debug, Clone, PartialEq)]
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
    /// The islands in scan order of their first pixels.
    pub islands: Vec<Island>,
    /// Amplitude of a typical surface at a range of one ambiguity interval, where amplitudes decided the counts.
    pub typical_amplitude_at_interval: Option<f32>,
}

/// A connected part of the mask.
#[derive(Debug, Clone, PartialEq)]
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
    /// Pixels that are masked or whose confidence is below `minimum_confidence`.
    pub fn unsure(&self, minimum_confidence: f32) -> Raster<bool> {
        let mut unsure = self.confidence.map(|&confidence| confidence < minimum_confidence);
        for (unsure, &island) in unsure.as_mut_slice().iter_mut().zip(self.island.as_slice()) {
            *unsure |= island == 0;
        }
        unsure
    }
}
