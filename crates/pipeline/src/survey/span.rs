//! Pixels outside the span of ranges and amplitudes that a calibration rests on.

use range_image::{Flags, RangeFrame, Raster};
use range_io::calibration::ValidSpan;

use crate::{Error, Result};
use commands::{Doubt, DoubtKind, Tape};

/// Part of the pixels outside the span from which on it is no matter of a few.
const LARGE_SHARE: f64 = 0.2;

/// What was found of the span in all frames that were corrected.
#[derive(Debug, Default)]
pub struct SpanTally {
    /// Pixels with a range and no other flag.
    measured: usize,
    /// Those of them that are outside.
    outside: usize,
    /// Shortest and longest range of them all, metre.
    range_m: Option<[f64; 2]>,
    /// Smallest and largest amplitude.
    amplitude: Option<[f64; 2]>,
}

/// Words for each part of a span that a pixel is outside of.
pub fn reasons(span: &ValidSpan, range_m: f64, amplitude: f64) -> impl Iterator<Item = String> {
    let words = |what: &str, value: f64, unit: &str, [low, high]: [f64; 2]| {
        format!(
            "the {what} of {value:.3}{unit} lies outside the {low:.3} to {high:.3}{unit} that the calibration rests on"
        )
    };
    let range = span.range_m.filter(|span| is_outside(*span, range_m));
    let light = span.amplitude.filter(|span| is_outside(*span, amplitude));
    let range = range.map(|span| words("range", range_m, " m", span));
    range.into_iter().chain(light.map(|span| words("amplitude", amplitude, "", span)))
}

/// A value that is not known is outside nothing.
fn is_outside([low, high]: [f64; 2], value: f64) -> bool {
    value < low || value > high
}

fn widen(span: &mut Option<[f64; 2]>, value: f64) {
    if value.is_finite() {
        let [low, high] = span.unwrap_or([value; 2]);
        *span = Some([low.min(value), high.max(value)]);
    }
}

impl SpanTally {
    /// Flags what is outside, by the ranges as they were observed. Values stay as they are.
    pub fn flag(&mut self, span: &ValidSpan, observed: &Raster<f32>, frame: &mut RangeFrame) {
        if span.range_m.is_none() && span.amplitude.is_none() {
            return;
        }
        let pixels = observed.as_slice().iter().zip(frame.amplitude.as_slice()).zip(frame.flags.as_mut_slice());
        for ((range, amplitude), flags) in pixels {
            let (range_m, amplitude) = (f64::from(*range), f64::from(*amplitude));
            if !range_m.is_finite() {
                continue;
            }
            let outside = span.leaves_out(range_m, amplitude);
            if flags.is_empty() {
                self.measured += 1;
                self.outside += usize::from(outside);
                widen(&mut self.range_m, range_m);
                widen(&mut self.amplitude, amplitude);
            }
            if outside {
                flags.insert(Flags::OUTSIDE_SPAN);
            }
        }
    }

    /// Adds what was found in another frame.
    pub(crate) fn join(&mut self, other: &Self) {
        self.measured += other.measured;
        self.outside += other.outside;
        other.range_m.into_iter().flatten().for_each(|end| widen(&mut self.range_m, end));
        other.amplitude.into_iter().flatten().for_each(|end| widen(&mut self.amplitude, end));
    }

    /// Writes it, or adds what was found in another part of the survey.
    pub(crate) fn carry(&mut self, tape: &mut Tape) {
        for count in [&mut self.measured, &mut self.outside] {
            tape.count(count);
        }
        for span in [&mut self.range_m, &mut self.amplitude] {
            let mut other = *span;
            tape.option(&mut other, || [0.0; 2], |tape, ends| ends.iter_mut().for_each(|end| tape.number(end)));
            other.into_iter().flatten().for_each(|end| widen(span, end));
        }
    }

    /// A doubt where a large part is outside.
    ///
    /// # Errors
    /// [`Error::Incompatible`] where everything is.
    pub fn judge(&self, span: &ValidSpan) -> Result<Option<Doubt>> {
        let share = self.outside as f64 / self.measured.max(1) as f64;
        if share <= LARGE_SHARE {
            return Ok(None);
        }
        let extent = |what: &str, span: Option<[f64; 2]>, found: Option<[f64; 2]>, unit: &str| {
            let ([low, high], [least, most]) = span.zip(found)?;
            Some(format!("{what} of {low:.3} to {high:.3}{unit}, and the survey shows {least:.3} to {most:.3}{unit}"))
        };
        let parts = [
            extent("ranges", span.range_m, self.range_m, " m"),
            extent("amplitudes", span.amplitude, self.amplitude, ""),
        ];
        let words = format!(
            "the calibration rests on {}: {:.0} % of the pixels are outside (span in calibration.ron). Calibrate over what is to \
             be measured, or name another calibration",
            parts.into_iter().flatten().collect::<Vec<_>>().join("; on "),
            100.0 * share
        );
        if self.outside == self.measured {
            return Err(Error::Incompatible(words));
        }
        Ok(Some(Doubt::new(DoubtKind::OutsideSpan, words)))
    }
}
