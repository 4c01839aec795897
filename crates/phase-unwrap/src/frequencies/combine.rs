//! Ranges of several frequencies brought together.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always, clippy::needless_range_loop, clippy::needless_bitwise_bool)]

use range_image::{Raster, with_wide_registers};

use crate::frequencies::lanes::LANES;
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
    let [values, deviations] = [ranges, sigmas].map(|planes| planes.iter().map(Raster::as_slice).collect::<Vec<_>>());
    let [range, sigma, chi_squared] = [&mut out.range, &mut out.sigma, &mut out.chi_squared].map(Raster::as_mut_slice);
    combine_pixels(&values, &deviations, CombinedPixels { range, sigma, chi_squared })?;
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
    if ranges.is_empty() {
        return Err(Error::TooFewFrequencies { found: 0 });
    }
    let CombinedPixels { range, sigma, chi_squared } = out;
    with_wide_registers(
        #[inline(always)]
        || {
            let out = [&mut *range, &mut *sigma, &mut *chi_squared];
            match (ranges, sigmas) {
                (&[a, b], &[c, d]) => combine_all(&[a, b], &[c, d], out), // A known number takes a sixth off a live frame.
                _ => combine_all(ranges, sigmas, out),
            }
        },
    );
    Ok(())
}

#[inline(always)]
fn combine_all(ranges: &[&[f32]], sigmas: &[&[f32]], mut out: [&mut [f32]; 3]) {
    let whole = out[0].len() / LANES * LANES;
    for start in (0..whole).step_by(LANES) {
        combine_lanes::<LANES>(ranges, sigmas, start, &mut out);
    }
    for start in whole..out[0].len() {
        combine_lanes::<1>(ranges, sigmas, start, &mut out);
    }
}

/// Means, sigmas and chi-squareds of `L` pixels from `start` on. Ranges are taken as differences from the first one, which are as
/// exact in single precision as the ranges themselves.
#[inline(always)]
fn combine_lanes<const L: usize>(ranges: &[&[f32]], sigmas: &[&[f32]], start: usize, out: &mut [&mut [f32]; 3]) {
    // Compared with infinity, it would become a question for the class of the number, which compilers answer lane by lane.
    let is_finite = |value: f32| value.abs() <= f32::MAX;
    let (mut first, mut weight, mut weighted, mut known) = ([0.0; L], [0.0; L], [0.0; L], [0.0; L]);
    let (mut sum, mut count) = ([0.0; L], [0.0; L]);
    let own_weight = |range: f32, sigma: f32| {
        let known = is_finite(range) & is_finite(sigma) & (sigma > 0.0);
        if known { 1.0 / (sigma * sigma) } else { 0.0 }
    };
    let planes = ranges.iter().zip(sigmas);
    let pixels = planes
        .filter_map(|(range, sigma)| Some((range[start..].first_chunk::<L>()?, sigma[start..].first_chunk::<L>()?)));
    for (range, sigma) in pixels.clone() {
        for lane in 0..L {
            let (there, own) = (is_finite(range[lane]), own_weight(range[lane], sigma[lane]));
            first[lane] = if there & (count[lane] < 0.5) { range[lane] } else { first[lane] };
            let off = if there { range[lane] - first[lane] } else { 0.0 };
            weight[lane] += own;
            weighted[lane] += off * own;
            known[lane] += if own > 0.0 { 1.0 } else { 0.0 };
            sum[lane] += off;
            count[lane] += if there { 1.0 } else { 0.0 };
        }
    }
    let (mut shift, mut chi_squared) = ([0.0; L], [0.0; L]);
    let mut found = [[0.0; L]; 3];
    for lane in 0..L {
        // Deviations beyond 1e19 m, or their reciprocals, square to no weight.
        let weighs = (weight[lane] > 0.0) & is_finite(weight[lane]);
        let inverse = 1.0 / if weighs { weight[lane] } else { count[lane] };
        shift[lane] = if weighs { weighted[lane] } else { sum[lane] } * inverse;
        found[0][lane] = first[lane] + shift[lane];
        found[1][lane] = if weighs { inverse.sqrt() } else { f32::NAN };
        found[2][lane] = if weighs & (known[lane] > 1.5) { 0.0 } else { f32::NAN };
    }
    for (range, sigma) in pixels {
        for lane in 0..L {
            let (own, off) = (own_weight(range[lane], sigma[lane]), range[lane] - first[lane] - shift[lane]);
            chi_squared[lane] += if own > 0.0 { off * off * own } else { 0.0 };
        }
    }
    for lane in 0..L {
        found[2][lane] += chi_squared[lane];
    }
    for (out, found) in out.iter_mut().zip(&found) {
        if let Some(out) = out[start..].first_chunk_mut() {
            *out = *found;
        }
    }
}
