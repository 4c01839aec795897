//! Taking the range errors off a frame.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use std::ops::Range;

use range_image::{Flags, ImageFormat, RangeFrame, Raster, with_wide_registers};

use crate::correction::chunks::{Chunk, Planes};
use crate::correction::kernel::{Block, Kernel, LANES, Lanes, Mask, Parts};
use crate::correction::kernel_tally::LaneTally;
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
///
/// ```
/// use error_models::range_image::{ImageFormat, RangeFrame, Raster};
/// use error_models::{RangeErrorModel, RangeTerms, correct_frame};
///
/// // All ranges are 24 mm too long; the ambiguity interval is 7.5 m, pixels are 40 micrometres apart.
/// let terms = RangeTerms { d0: 0.024, ..RangeTerms::default() };
/// let model = RangeErrorModel { terms, ..RangeErrorModel::error_free(7.5) };
/// let mut frame = RangeFrame::from_range(Raster::filled(176, 144, 3.024));
/// correct_frame(&mut frame, &model, &ImageFormat::new(176, 144, [0.04, 0.04])?, [0.0, 0.0], None)?;
/// assert!((frame.range[(88, 72)] - 3.0).abs() < 1e-6);
/// # Ok::<(), error_models::Error>(())
/// ```
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
    correct_planes(planes, model, format, principal_point_mm)
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
            || correct_chunk::<true>(chunk, &kernel, 0..format.width),
        );
        Ok(())
    })?;
    Ok(tally.summary(format.width * format.height, model.terms.d0, -1.0))
}

/// Corrects a chunk whose rows reach over these columns of the frame; the first is a multiple of a block. What was corrected is
/// counted where `COUNTS` says so.
#[inline(always)]
pub(crate) fn correct_chunk<const COUNTS: bool>(chunk: &mut Chunk<'_>, kernel: &Kernel, columns: Range<usize>) {
    let (first_column, width) = (columns.start, columns.len());
    let mut parts = Parts::default();
    for row in 0..chunk.range.len() / width {
        let mut tally = LaneTally::<COUNTS>::new();
        kernel.begin_row(chunk.first_row + row, &mut parts);
        for column in (0..width).step_by(LANES) {
            let start = row * width + column;
            let place = [first_column + column, chunk.first_row + row];
            if column + LANES <= width {
                correct_block(chunk, start, kernel, place, &mut parts, &mut tally);
            } else {
                correct_rest(chunk, start..start + width - column, kernel, place, &mut parts, &mut tally);
            }
        }
        if COUNTS {
            chunk.tally.add(&tally.total(kernel.d0));
        }
    }
}

/// A whole block, in place.
#[inline(always)]
fn correct_block<const COUNTS: bool>(
    chunk: &mut Chunk<'_>,
    start: usize,
    kernel: &Kernel,
    place: [usize; 2],
    parts: &mut Parts,
    tally: &mut LaneTally<COUNTS>,
) {
    let (Some(range), Some(amplitude)) =
        (chunk.range[start..].first_chunk_mut(), chunk.amplitude[start..].first_chunk())
    else {
        return;
    };
    let pattern = chunk.pattern.and_then(|pattern| pattern[start..].first_chunk());
    let mut none = [f32::NAN; LANES];
    let sigma = chunk.sigma.as_mut().and_then(|sigma| sigma[start..].first_chunk_mut()).unwrap_or(&mut none);
    let outside = kernel.correct(Block { range, sigma, amplitude, pattern }, place, parts, tally);
    if let Some(own) = chunk.pattern_sigma.and_then(|own| own[start..].first_chunk::<LANES>()) {
        add_deviations(sigma, own, &parts.inside);
    }
    flag(&mut chunk.flags[start..start + LANES], outside.as_ref());
}

/// The end of a row, in a block filled up with pixels that have no range.
#[inline(always)]
fn correct_rest<const COUNTS: bool>(
    chunk: &mut Chunk<'_>,
    pixels: Range<usize>,
    kernel: &Kernel,
    place: [usize; 2],
    parts: &mut Parts,
    tally: &mut LaneTally<COUNTS>,
) {
    let length = pixels.len();
    let [mut range, mut sigma, mut amplitude] = [[f32::NAN; LANES]; 3];
    range[..length].copy_from_slice(&chunk.range[pixels.clone()]);
    amplitude[..length].copy_from_slice(&chunk.amplitude[pixels.clone()]);
    if let Some(own) = &chunk.sigma {
        sigma[..length].copy_from_slice(&own[pixels.clone()]);
    }
    let filled = |plane: &[f32]| {
        let mut block = [0.0; LANES];
        block[..length].copy_from_slice(&plane[pixels.clone()]);
        block
    };
    let pattern = chunk.pattern.map(filled);
    let block = Block { range: &mut range, sigma: &mut sigma, amplitude: &amplitude, pattern: pattern.as_ref() };
    let outside = kernel.correct(block, place, parts, tally);
    if let Some(own) = chunk.pattern_sigma.map(filled) {
        add_deviations(&mut sigma, &own, &parts.inside);
    }
    chunk.range[pixels.clone()].copy_from_slice(&range[..length]);
    if let Some(own) = &mut chunk.sigma {
        own[pixels.clone()].copy_from_slice(&sigma[..length]);
    }
    flag(&mut chunk.flags[pixels], outside.as_ref());
}

/// What the offsets themselves are uncertain by; a pixel without a known offset, or outside the range span, keeps its
/// deviation.
#[inline(always)]
#[allow(clippy::needless_bitwise_bool)] // a branch would keep the loop scalar
fn add_deviations(sigma: &mut Lanes, own: &Lanes, inside: &Mask) {
    for ((sigma, own), inside) in sigma.iter_mut().zip(own).zip(inside) {
        let both = (*sigma * *sigma + own * own).sqrt();
        *sigma = if own.is_nan() | (*inside == 0) { *sigma } else { both };
    }
}

#[inline(always)]
fn flag(flags: &mut [Flags], outside: Option<&Mask>) {
    let Some(outside) = outside else { return };
    for (flags, outside) in flags.iter_mut().zip(outside) {
        *flags = Flags::from_bits_retain(flags.bits() | (*outside as u16 & Flags::OUTSIDE_SPAN.bits()));
    }
}
