//! What the camera does to the amplitude of one path at each frequency.

use range_image::{ComplexFrame, Flags};
use statistics::{mad_scale, upper_median};

use crate::error::require_positive;
use crate::{Error, Result};

/// Amplitude of one and the same single path at each frequency, as factors; only their ratios matter.
///
/// It falls with the frequency: the sensor's modulation contrast and the light source both do.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct FrequencyResponse {
    /// One positive factor for each frequency, in the frame's order.
    pub contrast: Vec<f64>,
}

impl FrequencyResponse {
    /// The same contrast at all frequencies.
    pub fn flat(frequencies: usize) -> Self {
        Self { contrast: vec![1.0; frequencies] }
    }

    /// Refuses another number of factors than `frequencies`, and factors that are not positive and finite.
    pub fn validate(&self, frequencies: usize) -> Result<()> {
        if self.contrast.len() != frequencies {
            let found = self.contrast.len();
            return Err(Error::Count { what: "factors of the frequency response", found, expected: frequencies });
        }
        self.contrast.iter().try_for_each(|factor| require_positive("contrast", *factor))
    }
}

/// A frequency response and how well one describes the frame it came from.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseEstimate {
    /// The factors; that of the first frequency is 1.
    pub response: FrequencyResponse,
    /// Relative scatter of the pixels' own factors about each one (from their median absolute deviation):
    /// noise, multipath, and what differs from pixel to pixel.
    pub spread: Vec<f64>,
    /// Pixels that took part.
    pub pixels: usize,
}

/// Fewest pixels of which a median ratio is taken. A choice: the median is known to a quarter of the spread of one
/// ratio.
const LEAST_PIXELS: usize = 25;

/// Estimates the response as the median over the frame of each pixel's amplitude relative to that at the first frequency.
///
/// Pixels count that bear no flag and have, at each frequency, an amplitude of at least `least_snr` times its
/// standard deviation (any positive amplitude where sigma is not known). The median is that of single paths as long as
/// clearly more than half of these pixels are free of multipath: take a frame of a flat wall. At depth edges and in
/// corners the ratios err to both sides.
pub fn estimate_response(frame: &ComplexFrame, least_snr: f64) -> Result<ResponseEstimate> {
    frame.validate()?;
    crate::error::require_not_negative("least_snr", least_snr)?;
    let usable = usable_amplitudes(frame, least_snr);
    let frequencies = frame.channels.len();
    let pixels = usable.len() / frequencies.max(1);
    if pixels < LEAST_PIXELS {
        return Err(Error::TooFewPixels { what: "frequency response", found: pixels, least: LEAST_PIXELS });
    }
    let (mut contrast, mut spread) = (Vec::new(), Vec::new());
    for frequency in 0..frequencies {
        let mut ratios: Vec<f64> = usable.chunks_exact(frequencies).map(|pixel| pixel[frequency] / pixel[0]).collect();
        let middle = upper_median(&mut ratios);
        for ratio in &mut ratios {
            *ratio = (*ratio / middle - 1.0).abs();
        }
        contrast.push(middle);
        spread.push(mad_scale(&mut ratios));
    }
    Ok(ResponseEstimate { response: FrequencyResponse { contrast }, spread, pixels })
}

/// Amplitudes at all frequencies of the usable pixels, one pixel after the other.
fn usable_amplitudes(frame: &ComplexFrame, least_snr: f64) -> Vec<f64> {
    let mut usable = Vec::new();
    for (index, _) in frame.flags.as_slice().iter().enumerate().filter(|(_, flags)| **flags == Flags::empty()) {
        let before = usable.len();
        usable.extend(frame.channels.iter().map_while(|channel| {
            let at = |plane: &range_image::Raster<f32>| f64::from(plane.as_slice()[index]);
            let amplitude = at(&channel.real).hypot(at(&channel.imaginary));
            let sigma = at(&channel.sigma);
            let clear = sigma.is_nan() || amplitude >= least_snr * sigma;
            (amplitude > 0.0 && amplitude.is_finite() && clear).then_some(amplitude)
        }));
        if usable.len() - before < frame.channels.len() {
            usable.truncate(before);
        }
    }
    usable
}
