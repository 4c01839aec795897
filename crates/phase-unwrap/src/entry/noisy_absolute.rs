//! Absolute counts of noisy phases: relative counts first, then offsets by the brightness of blocks.

use std::f32::consts::TAU;

use range_image::Raster;

use crate::entry::noisy::{NoisyMethod, NoisyOptions, NoisyUnwrapped, unwrap_noisy};
use crate::filter::prefilter::{FEW, Filtered};
use crate::tree::cycle::{count_from_given, into_cycle};
use crate::{ImageGeometry, PhaseNoise, Result, SpatialOptions, Unwrapped, unwrap_spatial};

/// Side of the blocks whose brightness decides, in pixels: a quarter of the noise. Blocks of two pixels leave half of it,
/// too much from 1.2 rad on; blocks of eight lose objects of their size.
const SIDE: usize = 4;

/// Absolute wrap counts of one noisy image: [`unwrap_noisy`] with amplitudes.
///
/// `phase` is in radians of any cycle as in [`Unwrapper::unwrap`](crate::Unwrapper::unwrap), what is not finite is masked; `amplitude`, in any unit, is the one received; in
/// `mask`, true means use. All rasters have one size.
///
/// The relative counts of [`unwrap_noisy`] make means over blocks of 4 by 4 pixels possible, whose phases and amplitudes
/// are quiet. Those are cut at jumps and get absolute counts by brightness, continuity and
/// [`SpatialOptions::geometry`] as [`unwrap_spatial`] finds them, and every pixel takes over the offset of its block. So
/// objects smaller than a block share the offset of what surrounds them. With [`NoisyMethod::Tree`], and with
/// [`NoisyMethod::Auto`] where fewer than one pixel in twenty needs the filter, the result is that of [`unwrap_spatial`], bit for bit.
///
/// The confidence is that of the relative count times that of the block.
///
/// # Errors
/// Those of [`unwrap_noisy`] and [`unwrap_spatial`].
///
/// ```
/// use phase_unwrap::{NoisyMethod, NoisyOptions, PhaseNoise, SpatialOptions, unwrap_noisy_absolute};
/// use range_image::Raster;
///
/// // A floor from 2 m to 8 m; one cycle is 5 m. The phase is off by up to 1.2 rad.
/// let range = Raster::from_fn(96, 80, |_, row| 2.0 + 0.076 * row as f32);
/// let noise = |col: usize, row: usize| ((col * 7 + row * 13) % 11) as f32 * 0.24 - 1.2;
/// let phase = Raster::from_fn(96, 80, |col, row| (range[(col, row)] * 1.2566 + noise(col, row)).rem_euclid(6.283_185));
/// let amplitude = range.map(|r| 900.0 / (r * r));
/// let spatial = SpatialOptions { maximum_wraps: 1, ..SpatialOptions::default() };
/// let options = NoisyOptions { method: NoisyMethod::Auto, spatial, ..NoisyOptions::default() };
/// let found = unwrap_noisy_absolute(&phase, &amplitude, PhaseNoise::Uniform(0.76), None, &options)?;
/// assert_eq!((found.unwrapped.wraps[(50, 15)], found.unwrapped.wraps[(50, 70)]), (0, 1));
/// # Ok::<(), phase_unwrap::Error>(())
/// ```
pub fn unwrap_noisy_absolute(
    phase: &Raster<f32>,
    amplitude: &Raster<f32>,
    noise: PhaseNoise<'_>,
    mask: Option<&Raster<bool>>,
    options: &NoisyOptions,
) -> Result<NoisyUnwrapped> {
    phase.require_same_size(amplitude, "amplitude")?;
    let given = phase;
    let phase = into_cycle(given);
    let phase = phase.as_ref();
    let mut found = unwrap_noisy(phase, noise, mask, options)?;
    let noisy = found.filtered.radius.as_slice().iter().filter(|radius| **radius > 0).count();
    let quiet = (noisy as f32) < FEW * found.filtered.radius.len() as f32;
    if options.method == NoisyMethod::Tree || (options.method == NoisyMethod::Auto && quiet) {
        found.unwrapped = unwrap_spatial(phase, Some(amplitude), mask, &options.spatial)?;
        found.method = NoisyMethod::Tree;
    } else {
        let blocks = Blocks::new(phase, amplitude, &found.filtered, &found.unwrapped);
        let wrapped = blocks.unwrapped.map(|value| value.rem_euclid(TAU).clamp(0.0, TAU));
        let absolute = unwrap_spatial(&wrapped, Some(&blocks.amplitude), None, &of_blocks(&options.spatial))?;
        found.unwrapped.take_offsets(&blocks, &wrapped, &absolute, &options.spatial);
    }
    let Unwrapped { island, wraps, .. } = &mut found.unwrapped;
    count_from_given(given, |index| island.as_slice()[index] > 0, wraps);
    Ok(found)
}

/// The options as they hold for an image of blocks.
fn of_blocks(options: &SpatialOptions) -> SpatialOptions {
    let side = SIDE as f32;
    let geometry = options.geometry.map(|geometry| ImageGeometry {
        principal_distance_px: geometry.principal_distance_px / side,
        // The centre of the first block lies between its pixels.
        principal_point_px: geometry.principal_point_px.map(|at| (at - 0.5 * (side - 1.0)) / side),
    });
    SpatialOptions { geometry, amplitude_noise: options.amplitude_noise.map(|noise| noise / side), ..*options }
}

/// Means over blocks; NaN where no pixel is used, or none has light that is known.
struct Blocks {
    /// Relative unwrapped phase, radians.
    unwrapped: Raster<f32>,
    amplitude: Raster<f32>,
}

impl Blocks {
    fn new(phase: &Raster<f32>, amplitude: &Raster<f32>, filtered: &Filtered, found: &Unwrapped) -> Self {
        let (width, height) = (phase.width().div_ceil(SIDE), phase.height().div_ceil(SIDE));
        let mut sums = Raster::filled(width, height, [0.0_f32; 4]);
        for (index, &island) in found.island.as_slice().iter().enumerate() {
            let (col, row) = (index % phase.width(), index / phase.width());
            let (value, light) = (phase.as_slice()[index], amplitude.as_slice()[index]);
            if island == 0 {
                continue;
            }
            let sum = &mut sums[(col / SIDE, row / SIDE)];
            sum[0] += value + TAU * found.wraps.as_slice()[index] as f32;
            sum[1] += 1.0;
            if !light.is_finite() {
                continue;
            }
            // The part in phase with the surface: noise raises the amplitude itself.
            sum[2] += light * (value - filtered.phase.as_slice()[index]).cos();
            sum[3] += 1.0;
        }
        Self { unwrapped: sums.map(|sum| sum[0] / sum[1]), amplitude: sums.map(|sum| sum[2] / sum[3]) }
    }
}

impl Unwrapped {
    /// Moves each pixel by the cycles that its block is off.
    fn take_offsets(&mut self, blocks: &Blocks, wrapped: &Raster<f32>, absolute: &Unwrapped, options: &SpatialOptions) {
        let width = self.wraps.width();
        let maximum = i32::from(options.maximum_wraps);
        for index in 0..self.wraps.len() {
            let at = (index % width / SIDE, index / width / SIDE);
            let (wraps, confidence) =
                (&mut self.wraps.as_mut_slice()[index], &mut self.confidence.as_mut_slice()[index]);
            let off = (wrapped[at] - blocks.unwrapped[at]) / TAU;
            if off.is_finite() && self.island.as_slice()[index] > 0 {
                let count = wraps.saturating_add(off.round() as i32).saturating_add(absolute.wraps[at]);
                *wraps = count.clamp(0, maximum);
                // A count out of span was no solution: the pixel keeps the nearest, and says that it is a guess.
                *confidence *= if *wraps == count { absolute.confidence[at] } else { 0.0 };
            } else {
                *confidence = 0.0;
            }
        }
        self.typical_amplitude_at_interval = absolute.typical_amplitude_at_interval;
        let known = absolute.islands.iter().any(|island| island.offset_known);
        for island in &mut self.islands {
            (island.pixels, island.sure_pixels, island.offset_known) = (0, 0, known);
        }
        self.count_pixels(options.minimum_confidence);
    }
}
