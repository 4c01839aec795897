//! Putting the range errors onto a frame of true ranges.

use range_image::{Flags, ImageFormat, RangeFrame};

use crate::correction::chunks::{Chunk, Planes};
use crate::summary::{AMPLITUDE, DELAY, GROUPS, PATTERN, PERIODIC, POLYNOMIAL, TOTAL};
use crate::{CorrectionSummary, FixedPattern, RangeErrorModel, Result};

/// Turns true ranges into those that the camera would show, in place: the inverse of
/// [`correct_frame`](crate::correct_frame), with the same arguments.
///
/// The amplitudes are the observed ones; the standard deviation is divided by `|1 - ∂Δρ/∂ρ|`. What the model
/// does not cover is left out and flagged in the same way (see
/// [`RangeErrorModel::observed_range`]): a camera that is to be simulated errs everywhere, so give its model
/// spans that hold the whole scene. Each range is solved for in double precision.
///
/// Refuses what [`correct_frame`](crate::correct_frame) refuses; should a range not be found
/// ([`Error::NotConverged`](crate::Error::NotConverged)), the frame is left partly changed.
pub fn distort_frame(
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
    planes.validate(model, format, principal_point_mm)?;
    let tally = planes.for_each_chunk(|chunk| distort_chunk(chunk, model, format, principal_point_mm))?;
    Ok(tally.summary(format.width * format.height, model.terms.d0, 1.0))
}

fn distort_chunk(
    chunk: &mut Chunk<'_>,
    model: &RangeErrorModel,
    format: &ImageFormat,
    principal_point_mm: [f64; 2],
) -> Result<()> {
    for index in 0..chunk.range.len() {
        if !chunk.range[index].is_finite() {
            continue;
        }
        let pixel = [index % format.width, chunk.first_row + index / format.width];
        let [x, y] = format.image_from_pixel(pixel.map(|position| position as f64));
        distort_pixel(chunk, index, model, [x - principal_point_mm[0], y - principal_point_mm[1]])?;
    }
    Ok(())
}

fn distort_pixel(chunk: &mut Chunk<'_>, index: usize, model: &RangeErrorModel, [x, y]: [f64; 2]) -> Result<()> {
    let true_range = f64::from(chunk.range[index]);
    let amplitude = f64::from(chunk.amplitude[index]);
    let pattern = chunk.pattern.map_or(0.0, |pattern| f64::from(pattern[index]));
    chunk.tally.finite += 1;
    let observed = model.solve_observed_range(true_range + pattern, x, y, amplitude)?;
    let correction = observed.map(|range| (range, model.correction(range, x, y, amplitude)));
    if correction.is_none_or(|(_, correction)| correction.outside_span) {
        chunk.flags[index] |= Flags::OUTSIDE_SPAN;
        chunk.tally.outside_span += 1;
    }
    let Some((range, correction)) = correction else { return Ok(()) };
    chunk.range[index] = range as f32;
    if let Some(sigma) = &mut chunk.sigma {
        sigma[index] = (f64::from(sigma[index]) / (1.0 - correction.range_derivative).abs()) as f32;
    }
    let mut groups = [0.0; GROUPS];
    groups[TOTAL] = correction.total_m() + pattern;
    groups[PERIODIC] = correction.periodic_m;
    groups[DELAY] = correction.delay_m;
    groups[AMPLITUDE] = correction.amplitude_m;
    groups[PATTERN] = pattern;
    groups[POLYNOMIAL] = correction.polynomial_m;
    chunk.tally.count_corrected(groups);
    Ok(())
}
