//! Ranges of several frequencies brought together.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always, clippy::needless_range_loop)]

use range_image::{Raster, with_wide_registers};

use crate::{Error, Result};

/// Ranges of several frequencies combined.
#[derive(Debug, Clone, PartialEq)]
pub struct Combined {
    /// Inverse-variance mean in metres; NaN where no range is known.
    pub range: Raster<f32>,
    /// Standard deviation of `range` in metres; NaN where no sigma is known.
    pub sigma: Raster<f32>,
    /// Sum of squared residuals over their variances, `count - 1` degrees of freedom; NaN where fewer than two ranges
    /// with a sigma came together. Large values tell of multipath, mixed pixels or a wrong wrap count.
    pub chi_squared: Raster<f32>,
}

/// Inverse-variance mean of the unwrapped ranges of all frequencies, each corrected by its own range terms before.
///
/// A range that is not finite is left out. Where at least one sigma of a pixel is known (finite and positive), ranges
/// without one are left out too; where none is known the plain mean is taken and `sigma` is NaN.
pub fn combine_frequencies(ranges: &[Raster<f32>], sigmas: &[Raster<f32>]) -> Result<Combined> {
    let Some(first) = ranges.first() else {
        return Err(Error::TooFewFrequencies { found: 0 });
    };
    if sigmas.len() != ranges.len() {
        return Err(Error::PlaneCount { what: "sigma", expected: ranges.len(), found: sigmas.len() });
    }
    for plane in ranges {
        first.require_same_size(plane, "range")?;
    }
    for plane in sigmas {
        first.require_same_size(plane, "sigma")?;
    }
    let plane = || Raster::filled(first.width(), first.height(), f32::NAN);
    let mut out = Combined { range: plane(), sigma: plane(), chi_squared: plane() };
    let Combined { range, sigma, chi_squared } = &mut out;
    let mut rows = [range, sigma, chi_squared].map(|plane| plane.as_mut_slice().chunks_mut(first.width().max(1)));
    let (mut values, mut deviations) = (Vec::with_capacity(ranges.len()), Vec::with_capacity(ranges.len()));
    for row in 0..first.height() {
        let [Some(range), Some(sigma), Some(chi_squared)] = rows.each_mut().map(Iterator::next) else { break };
        let pixels = row * first.width()..(row + 1) * first.width();
        values.clear();
        values.extend(ranges.iter().map(|plane| &plane.as_slice()[pixels.clone()]));
        deviations.clear();
        deviations.extend(sigmas.iter().map(|plane| &plane.as_slice()[pixels.clone()]));
        combine_pixels(&values, &deviations, CombinedPixels { range, sigma, chi_squared })?;
    }
    Ok(out)
}

/// Some pixels of a [`Combined`].
#[derive(Debug)]
pub struct CombinedPixels<'a> {
    /// Inverse-variance mean in metres.
    pub range: &'a mut [f32],
    /// Standard deviation of `range` in metres.
    pub sigma: &'a mut [f32],
    /// Sum of squared residuals over their variances.
    pub chi_squared: &'a mut [f32],
}

/// As [`combine_frequencies`], of some pixels: one slice a frequency, all of one length. Allocates nothing.
pub fn combine_pixels(ranges: &[&[f32]], sigmas: &[&[f32]], out: CombinedPixels<'_>) -> Result<()> {
    let count = out.range.len();
    if sigmas.len() != ranges.len() {
        return Err(Error::PlaneCount { what: "sigma", expected: ranges.len(), found: sigmas.len() });
    }
    let of_planes = ranges.iter().chain(sigmas).map(|plane| plane.len());
    let mut lengths = of_planes.chain([out.sigma.len(), out.chi_squared.len()]);
    if let Some(found) = lengths.find(|found| *found != count) {
        let (width, height, expected) = (count, 1, count);
        return Err(range_image::Error::RasterLength { width, height, expected, found }.into());
    }
    // Of up to four frequencies the compiler knows the number and takes many pixels at once.
    match ranges.len() {
        0 => return Err(Error::TooFewFrequencies { found: 0 }),
        1 => combine_known::<1>(ranges, sigmas, out),
        2 => combine_known::<2>(ranges, sigmas, out),
        3 => combine_known::<3>(ranges, sigmas, out),
        4 => combine_known::<4>(ranges, sigmas, out),
        _ => {
            for pixel in 0..count {
                let at = |planes: &[&[f32]], frequency: usize| f64::from(planes[frequency][pixel]);
                let values = (0..ranges.len()).map(|frequency| (at(ranges, frequency), at(sigmas, frequency)));
                let [range, sigma, chi_squared] = combine_pixel(values);
                out.range[pixel] = range;
                out.sigma[pixel] = sigma;
                out.chi_squared[pixel] = chi_squared;
            }
        }
    }
    Ok(())
}

fn combine_known<const F: usize>(ranges: &[&[f32]], sigmas: &[&[f32]], out: CombinedPixels<'_>) {
    let (Some(ranges), Some(sigmas)) = (ranges.first_chunk::<F>(), sigmas.first_chunk::<F>()) else { return };
    let count = out.range.len();
    let (ranges, sigmas) = (ranges.map(|plane| &plane[..count]), sigmas.map(|plane| &plane[..count]));
    let CombinedPixels { range, sigma, chi_squared } = out;
    with_wide_registers(
        #[inline(always)]
        || {
            let (range, sigma, chi_squared) = (&mut range[..count], &mut sigma[..count], &mut chi_squared[..count]);
            for pixel in 0..count {
                let mut values = [(0.0, 0.0); F];
                for frequency in 0..F {
                    values[frequency] = (f64::from(ranges[frequency][pixel]), f64::from(sigmas[frequency][pixel]));
                }
                [range[pixel], sigma[pixel], chi_squared[pixel]] = combine_pixel(values.iter().copied());
            }
        },
    );
}

/// Mean, sigma and chi-squared of `(range, sigma)`.
#[inline(always)]
#[allow(clippy::needless_bitwise_bool)] // a branch would keep the loop around it scalar
fn combine_pixel(values: impl Iterator<Item = (f64, f64)> + Clone) -> [f32; 3] {
    let (mut weight, mut weighted, mut known) = (0.0, 0.0, 0.0);
    let (mut sum, mut count) = (0.0, 0.0);
    // Compared with infinity, it would become a question for the class of the number, which compilers answer lane by lane.
    let is_finite = |value: f64| value.abs() <= f64::MAX;
    let own_weight = |range: f64, sigma: f64| {
        let known = is_finite(range) & is_finite(sigma) & (sigma > 0.0);
        if known { 1.0 / (sigma * sigma) } else { 0.0 }
    };
    for (range, sigma) in values.clone() {
        let own = own_weight(range, sigma);
        weight += own;
        weighted += if own > 0.0 { range * own } else { 0.0 };
        known += if own > 0.0 { 1.0 } else { 0.0 };
        sum += if is_finite(range) { range } else { 0.0 };
        count += if is_finite(range) { 1.0 } else { 0.0 };
    }
    // Subnormal sigmas square to an infinite weight, which is no weight.
    let weighs = (weight > 0.0) & is_finite(weight);
    let mean = if weighs { weighted } else { sum } / if weighs { weight } else { count };
    let mut chi_squared = 0.0;
    for (range, sigma) in values {
        let (own, off) = (own_weight(range, sigma), range - mean);
        chi_squared += if own > 0.0 { off * off * own } else { 0.0 };
    }
    [
        mean as f32,
        if weighs { weight.sqrt().recip() as f32 } else { f32::NAN },
        if weighs & (known > 1.0) { chi_squared as f32 } else { f32::NAN },
    ]
}
