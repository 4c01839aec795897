//! Where the object is: every pixel whose own light may have changed.

use range_image::{ComplexChannel, ComplexFrame, Raster};

use crate::Result;
use crate::estimate::{Capture, EstimationOptions, ForegroundCapture};

/// A shadow takes more than this share of a pixel's light. Where scattered light of the opposite phase does the same,
/// something is left out that need not be.
const SHADOW_LOSS: f32 = 0.4;
/// ... and so many standard deviations of a single pixel, of which the median has a third.
const SHADOW_SIGMAS: f32 = 3.0;

/// Finds the pixels of the foreground object from the two frames of a capture: where the complex images differ by more
/// than [`EstimationOptions::object_share`] of the largest difference (after a median over 3 x 3 pixels, which single
/// wrong pixels do not pass) at any frequency, or where much of the light is gone (the object's shadow), and everything
/// within [`EstimationOptions::rim_px`] of these.
///
/// Scattered light is far below that share beside the object. What is dimmer than that and not scattered, such as a dark
/// part of the object, is found later, when the model does not fit there. A pixel too many does no harm: inside the mask
/// the light is taken as it was observed.
pub fn object_mask(
    with_object: &ComplexFrame,
    without_object: &ComplexFrame,
    options: &EstimationOptions,
) -> Result<Raster<bool>> {
    options.validate()?;
    Capture::Foreground(ForegroundCapture { with_object, without_object, object: None }).checked_size()?;
    Ok(find_object(with_object, without_object, options))
}

pub(in crate::estimate) fn find_object(
    with: &ComplexFrame,
    without: &ComplexFrame,
    options: &EstimationOptions,
) -> Raster<bool> {
    let (width, height) = (with.width(), with.height());
    let mut core = Raster::filled(width, height, false);
    for (with_channel, without_channel) in with.channels.iter().zip(&without.channels) {
        let change = median_of_nine(&change(with_channel, without_channel));
        let largest = change.as_slice().iter().copied().fold(0.0, f32::max);
        let limit = options.object_share as f32 * largest;
        for (inside, change) in core.as_mut_slice().iter_mut().zip(change.as_slice()) {
            *inside |= largest > 0.0 && *change >= limit;
        }
        let noise = [&with_channel.sigma, &without_channel.sigma].map(Raster::as_slice);
        let amplitudes = [with_channel, without_channel].map(|channel| median_of_nine(&channel.amplitude()));
        for (pixel, inside) in core.as_mut_slice().iter_mut().enumerate() {
            let [now, before] = [0, 1].map(|i| amplitudes[i].as_slice()[pixel]);
            let loudest = noise.iter().map(|sigma| sigma[pixel]).fold(0.0, f32::max);
            *inside |= before - now > (SHADOW_LOSS * before).max(SHADOW_SIGMAS * loudest);
        }
    }
    dilated(&core, options.rim_px)
}

/// Modulus of the difference; zero where it is not finite.
fn change(with: &ComplexChannel, without: &ComplexChannel) -> Raster<f32> {
    let mut out = with.real.clone();
    let real = with.real.as_slice().iter().zip(without.real.as_slice());
    let imaginary = with.imaginary.as_slice().iter().zip(without.imaginary.as_slice());
    for (out, ((re, other_re), (im, other_im))) in out.as_mut_slice().iter_mut().zip(real.zip(imaginary)) {
        let modulus = (re - other_re).hypot(im - other_im);
        *out = if modulus.is_finite() { modulus } else { 0.0 };
    }
    out
}

/// Median over the pixel and its neighbours inside the image.
fn median_of_nine(plane: &Raster<f32>) -> Raster<f32> {
    let mut values = Vec::with_capacity(9);
    Raster::from_fn(plane.width(), plane.height(), |col, row| {
        values.clear();
        for r in row.saturating_sub(1)..=row + 1 {
            values.extend((col.saturating_sub(1)..=col + 1).filter_map(|c| plane.get(c, r).copied()));
        }
        values.sort_unstable_by(f32::total_cmp);
        values[values.len() / 2]
    })
}

/// Every pixel within a square of `reach` about one that is set.
pub(in crate::estimate) fn dilated(mask: &Raster<bool>, reach: usize) -> Raster<bool> {
    let (width, height) = (mask.width(), mask.height());
    let near = |index: usize, length: usize| {
        index.saturating_sub(reach)..(index.saturating_add(reach).saturating_add(1)).min(length)
    };
    let along_rows =
        Raster::from_fn(width, height, |col, row| near(col, width).any(|c| mask.get(c, row).copied().unwrap_or(false)));
    Raster::from_fn(width, height, |col, row| {
        near(row, height).any(|r| along_rows.get(col, r).copied().unwrap_or(false))
    })
}
