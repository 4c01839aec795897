use range_image::Raster;

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
    for index in 0..first.len() {
        let values = ranges.iter().zip(sigmas).map(|(r, s)| (r.as_slice()[index].into(), s.as_slice()[index].into()));
        let pixel = combine_pixel(values);
        out.range.as_mut_slice()[index] = pixel[0] as f32;
        out.sigma.as_mut_slice()[index] = pixel[1] as f32;
        out.chi_squared.as_mut_slice()[index] = pixel[2] as f32;
    }
    Ok(out)
}

/// Mean, sigma and chi-squared of `(range, sigma)`.
fn combine_pixel(values: impl Iterator<Item = (f64, f64)> + Clone) -> [f64; 3] {
    let finite = values.filter(|(range, _)| range.is_finite());
    let weighted = finite.clone().filter(|(_, sigma)| sigma.is_finite() && *sigma > 0.0);
    let weight: f64 = weighted.clone().map(|(_, sigma)| sigma.powi(-2)).sum();
    // Subnormal sigmas square to an infinite weight, which is no weight.
    if weight > 0.0 && weight.is_finite() {
        let mean = weighted.clone().map(|(range, sigma)| range * sigma.powi(-2)).sum::<f64>() / weight;
        let chi_squared = weighted.clone().map(|(range, sigma)| ((range - mean) / sigma).powi(2)).sum();
        let several = weighted.count() > 1;
        return [mean, weight.sqrt().recip(), if several { chi_squared } else { f64::NAN }];
    }
    let count = finite.clone().count() as f64;
    [finite.map(|(range, _)| range).sum::<f64>() / count, f64::NAN, f64::NAN]
}
