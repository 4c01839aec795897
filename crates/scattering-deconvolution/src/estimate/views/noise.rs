//! Standard deviations of the pixels.

use range_image::Raster;
use statistics::mad_scale;

/// Noise below this share of the largest light is rounding of single precision.
const ROUNDING: f64 = 6e-8;

/// Variances of the parts of an image that is the sum or difference of others.
pub(in crate::estimate) struct Deviations<'a> {
    sigmas: Vec<&'a [f32]>,
    /// Used where a sigma is not known.
    fallback: f64,
}

impl<'a> Deviations<'a> {
    pub(in crate::estimate) fn new(sigmas: &[&'a Raster<f32>], fallback: f64) -> Self {
        Self { sigmas: sigmas.iter().map(|sigma| sigma.as_slice()).collect(), fallback }
    }

    /// Variance of each part of a pixel.
    pub(in crate::estimate) fn variance(&self, pixel: usize) -> f64 {
        let variance: f64 = self.sigmas.iter().map(|sigma| f64::from(sigma[pixel]).powi(2)).sum();
        if variance.is_finite() { variance } else { self.fallback.powi(2) }
    }

    /// Smallest standard deviation that a mean may have: images without noise are rounded.
    pub(in crate::estimate) fn floor(real: &[f64], imaginary: &[f64], usable: &[bool]) -> f64 {
        let parts = real.iter().zip(imaginary).zip(usable).filter(|(_, usable)| **usable);
        let largest = parts.map(|((re, im), _)| re.abs().max(im.abs())).fold(0.0, f64::max);
        (ROUNDING * largest).max(f64::MIN_POSITIVE.sqrt())
    }
}

/// Standard deviation of the noise from the differences of neighbouring pixels in a row, robustly; NaN where there are
/// none. Scattered light hardly changes from pixel to pixel.
pub(in crate::estimate) fn noise_of_differences(values: &[f64], quiet: &[bool], width: usize) -> f64 {
    let rows = values.chunks_exact(width.max(1)).zip(quiet.chunks_exact(width.max(1)));
    let pairs = rows.flat_map(|(values, quiet)| values.windows(2).zip(quiet.windows(2)));
    let quiet_pairs = pairs.filter(|(_, quiet)| quiet[0] && quiet[1]);
    let mut differences: Vec<f64> = quiet_pairs.map(|(values, _)| (values[1] - values[0]).abs()).collect();
    mad_scale(&mut differences) / std::f64::consts::SQRT_2
}
