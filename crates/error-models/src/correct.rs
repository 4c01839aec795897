//! Taking the range errors off a frame.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use range_image::{Flags, ImageFormat, RangeFrame, Raster, with_wide_registers};

use crate::chunks::{Chunk, Planes};
use crate::kernel::{Block, Kernel, LANES, LaneTally, Parts};
use crate::{CorrectionSummary, FixedPattern, RangeErrorModel, Result};

/// Takes the range errors of `model`, and then those of `pattern`, off a frame, in place.
///
/// `principal_point_mm` is (xp, yp), from which Eq. 14 counts its image coordinates. The standard deviation
/// is transported by `|1 - ∂Δρ/∂ρ|`; the deviations of the pattern's offsets, where they are known, are added.
///
/// Nothing is extrapolated; a pixel that the model does not cover gets [`Flags::OUTSIDE_SPAN`]:
/// - Its range is outside `range_span_m` (or beyond 4096 ambiguity intervals): it keeps its observed range
///   and standard deviation.
/// - Its amplitude is outside the span of the hyperbola or NaN, or the radicand of Eq. 15 is negative: it
///   keeps the range corrected by Eq. 14 and the pattern, without the hyperbola.
///
/// Pixels without a finite range stay as they are. Single precision: the result differs from
/// [`RangeErrorModel::corrected_range`] by a unit in the last place of the range and about a millionth of the
/// coefficients. Same bits for any number of threads; no memory is allocated but
/// what rayon needs for its own bookkeeping.
///
/// Refuses a model that [`RangeErrorModel::validate`] refuses, a bad pattern, and sizes that differ; the frame
/// is untouched then.
pub fn correct_frame(
    frame: &mut RangeFrame,
    model: &RangeErrorModel,
    format: &ImageFormat,
    principal_point_mm: [f64; 2],
    pattern: Option<&FixedPattern>,
) -> Result<CorrectionSummary> {
    let planes = Planes {
        range: &mut frame.range,
        sigma: Some(&mut frame.sigma),
        amplitude: &frame.amplitude,
        flags: &mut frame.flags,
        pattern,
    };
    let summary = correct_planes(planes, model, format, principal_point_mm)?;
    if let Some(pattern) = pattern {
        add_deviations(&mut frame.sigma, pattern);
    }
    Ok(summary)
}

/// What the offsets themselves are uncertain by; a pixel without a known offset keeps its deviation.
fn add_deviations(sigma: &mut Raster<f32>, pattern: &FixedPattern) {
    for (sigma, own) in sigma.as_mut_slice().iter_mut().zip(&pattern.sigma_m) {
        if own.is_finite() {
            *sigma = sigma.hypot(*own);
        }
    }
}

/// [`correct_frame`] on bare rasters: the unwrapped ranges of one of several modulation frequencies, with its
/// own model, before the frequencies are combined.
pub fn correct_raster(
    range: &mut Raster<f32>,
    amplitude: &Raster<f32>,
    flags: &mut Raster<Flags>,
    model: &RangeErrorModel,
    format: &ImageFormat,
    principal_point_mm: [f64; 2],
) -> Result<CorrectionSummary> {
    let planes = Planes { range, sigma: None, amplitude, flags, pattern: None };
    correct_planes(planes, model, format, principal_point_mm)
}

fn correct_planes(
    planes: Planes<'_>,
    model: &RangeErrorModel,
    format: &ImageFormat,
    principal_point_mm: [f64; 2],
) -> Result<CorrectionSummary> {
    planes.validate(model, format, principal_point_mm)?;
    let kernel = Kernel::new(model, format, principal_point_mm);
    let tally = planes.for_each_chunk(|chunk| {
        // Products and sums stay separate operations, so that all machines give the same bits.
        with_wide_registers(
            #[inline(always)]
            || correct_chunk(chunk, &kernel, format.width),
        );
        Ok(())
    })?;
    Ok(tally.summary(format.width * format.height, model.terms.d0, -1.0))
}

#[inline(always)]
fn correct_chunk(chunk: &mut Chunk<'_>, kernel: &Kernel, width: usize) {
    let (mut block, mut parts) = (Block::empty(), Parts::default());
    for row in 0..chunk.range.len() / width {
        let mut tally = LaneTally::new();
        for column in (0..width).step_by(LANES) {
            let start = row * width + column;
            let length = LANES.min(width - column);
            load(chunk, start, length, &mut block);
            kernel.correct(&mut block, [column, chunk.first_row + row], &mut parts, &mut tally);
            store(chunk, start, length, &block);
        }
        chunk.tally.add(&tally.total());
    }
}

#[inline(always)]
fn load(chunk: &Chunk<'_>, start: usize, length: usize, block: &mut Block) {
    if length < LANES {
        *block = Block::empty();
    }
    let pixels = start..start + length;
    copy(&chunk.range[pixels.clone()], &mut block.range);
    copy(&chunk.amplitude[pixels.clone()], &mut block.amplitude);
    if let Some(sigma) = &chunk.sigma {
        copy(&sigma[pixels.clone()], &mut block.sigma);
    }
    if let Some(pattern) = chunk.pattern {
        copy(&pattern[pixels.clone()], &mut block.pattern);
        block.has_pattern = true;
    }
    copy(&chunk.flags[pixels], &mut block.flags);
}

#[inline(always)]
fn store(chunk: &mut Chunk<'_>, start: usize, length: usize, block: &Block) {
    let pixels = start..start + length;
    copy(&block.range[..length], &mut chunk.range[pixels.clone()]);
    if let Some(sigma) = &mut chunk.sigma {
        copy(&block.sigma[..length], &mut sigma[pixels.clone()]);
    }
    copy(&block.flags[..length], &mut chunk.flags[pixels]);
}

/// Copies all of `from`; of a whole block without a call of a library.
#[inline(always)]
fn copy<T: Copy>(from: &[T], to: &mut [T]) {
    if let (Some(from), Some(to)) = (from.first_chunk::<LANES>(), to.first_chunk_mut::<LANES>()) {
        *to = *from;
    } else {
        to[..from.len()].copy_from_slice(from);
    }
}
