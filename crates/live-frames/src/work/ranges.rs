//! Corrected ranges of one frequency, a row at a time: what a row needs stays near while it is worked on.
// Only what is inlined is compiled for wide registers; loops over lanes read as their formulas, without branches.
#![allow(clippy::inline_always, clippy::needless_range_loop, clippy::needless_bitwise_bool)]

use camera_model::RayTable;
use error_models::{FrameRows, PreparedCorrection};
use range_image::{Flags, Modulation, with_wide_registers};
use range_io::calibration::ValidSpan;
use scattering_deconvolution::{ChannelRow, Restorer};

use crate::error::Result;

/// What all rows are worked on with.
pub(crate) struct Rules<'a> {
    pub(crate) rays: &'a RayTable,
    /// Takes off the scattered light that was found.
    pub(crate) restorer: Option<&'a Restorer>,
    /// One a frequency; none where nothing is to be corrected.
    pub(crate) corrections: Option<&'a [PreparedCorrection]>,
    pub(crate) span: ValidSpan,
    /// Whether the whole frame lies outside of what the calibration rests on.
    pub(crate) all_outside: bool,
    pub(crate) minimum_confidence: f64,
    pub(crate) width: usize,
}

impl Rules<'_> {
    /// Takes scattered light off a row of the channel at an index.
    pub(crate) fn take_off_row(&self, [row, index]: [usize; 2], pixels: ChannelRow<'_>) {
        if let Some(restorer) = self.restorer {
            restorer.take_off_row(index, row, pixels);
        }
    }
}

/// One frequency in a row.
pub(crate) struct Channel<'a> {
    pub(crate) modulation: Modulation,
    pub(crate) phase: &'a [f32],
    pub(crate) wraps: &'a [i32],
    pub(crate) amplitude: &'a [f32],
    /// Standard deviation of the phase; `None` where that of the range is there already.
    pub(crate) sigma_phase: Option<&'a [f32]>,
    pub(crate) range: &'a mut [f32],
    pub(crate) sigma: &'a mut [f32],
}

impl Channel<'_> {
    /// Corrected ranges of row `row` of the frame, of the frequency at `index`, from phases and counts. What has no phase is not
    /// sure of its count, and what lies outside of the limits, by the ranges as they were observed, is flagged.
    pub(crate) fn correct(mut self, [row, index]: [usize; 2], rules: &Rules<'_>, flags: &mut [Flags]) -> Result<()> {
        let correction = rules.corrections.and_then(|corrections| corrections.get(index));
        self.fill(&Limits::new(rules, correction.is_some()), flags);
        let Some(correction) = correction else { return Ok(()) };
        let Self { range, sigma, amplitude, .. } = self;
        Ok(correction.correct_rows(row, FrameRows { range, sigma, amplitude, flags })?)
    }

    fn fill(&mut self, limits: &Limits, flags: &mut [Flags]) {
        let Self { modulation, phase, wraps, amplitude, sigma_phase, .. } = *self;
        // As `Modulation::range_from_phase` has them.
        let metres = [modulation.range_from_phase(1.0), modulation.ambiguity_interval_m()];
        let mut row = Filled { metres, phase, wraps, amplitude, range: &mut *self.range, flags };
        with_wide_registers(
            #[inline(always)]
            || {
                in_lanes(
                    row.phase.len(),
                    #[inline(always)]
                    |start, lanes| {
                        if lanes { row.pixels::<LANES>(start, limits) } else { row.pixels::<1>(start, limits) }
                    },
                );
            },
        );
        let Some(sigma_phase) = sigma_phase else { return };
        let unit = metres[0] as f32;
        for (sigma, of_phase) in self.sigma.iter_mut().zip(sigma_phase) {
            *sigma = unit * of_phase;
        }
    }
}

/// Pixels taken at a time, so that the compiler can vectorise.
const LANES: usize = 32;

/// Calls `work` for places in a row of so many pixels: where whole lanes begin, and where one more pixel stands.
#[inline(always)]
fn in_lanes(count: usize, mut work: impl FnMut(usize, bool)) {
    let whole = count / LANES * LANES;
    // Not `for_each`, whose closure would stay behind in narrow registers.
    for start in (0..whole).step_by(LANES) {
        work(start, true);
    }
    for start in whole..count {
        work(start, false);
    }
}

/// What ranges and amplitudes of one frequency may be; in single precision, where comparing them comes to the same.
struct Limits {
    range: [f32; 2],
    amplitude: [f32; 2],
    /// All bits of the flag where the whole frame lies outside.
    all: u32,
}

impl Limits {
    /// Nothing is outside where nothing is corrected.
    fn new(rules: &Rules<'_>, corrects: bool) -> Self {
        let single = |span: Option<[f64; 2]>| {
            let [low, high] = span.filter(|_| corrects).unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
            [least_single(low), -least_single(-high)]
        };
        let all = if corrects && rules.all_outside { u32::from(Flags::OUTSIDE_SPAN.bits()) } else { 0 };
        Self { range: single(rules.span.range_m), amplitude: single(rules.span.amplitude), all }
    }
}

/// The smallest single-precision number that is not below a bound.
fn least_single(bound: f64) -> f32 {
    let nearest = bound as f32;
    if f64::from(nearest) < bound { nearest.next_up() } else { nearest }
}

/// A row of one frequency while its ranges are filled in.
struct Filled<'a> {
    /// Of a radian, and of a cycle.
    metres: [f64; 2],
    phase: &'a [f32],
    wraps: &'a [i32],
    amplitude: &'a [f32],
    range: &'a mut [f32],
    flags: &'a mut [Flags],
}

impl Filled<'_> {
    /// `L` pixels from `start` on.
    #[inline(always)]
    fn pixels<const L: usize>(&mut self, start: usize, limits: &Limits) {
        let (Some(phase), Some(wraps)) =
            (self.phase[start..].first_chunk::<L>(), self.wraps[start..].first_chunk::<L>())
        else {
            return;
        };
        let (Some(amplitude), Some(range)) =
            (self.amplitude[start..].first_chunk::<L>(), self.range[start..].first_chunk_mut::<L>())
        else {
            return;
        };
        let Some(flags) = self.flags[start..].first_chunk_mut::<L>() else { return };
        let [per_radian, interval_m] = self.metres;
        let (unsure, outside) = (u32::from(Flags::UNWRAP_UNSURE.bits()), u32::from(Flags::OUTSIDE_SPAN.bits()));
        let mut found = [0_u32; L];
        for i in 0..L {
            range[i] = (f64::from(phase[i]) * per_radian + f64::from(wraps[i]) * interval_m) as f32;
        }
        for i in 0..L {
            let ([near, far], [dark, bright]) = (limits.range, limits.amplitude);
            let (r, a) = (range[i], amplitude[i]);
            let beyond = (r < near) | (r > far) | (a < dark) | (a > bright);
            let beyond = if beyond { outside } else { limits.all };
            found[i] = if phase[i].is_nan() { unsure } else { 0 } | if r.abs() <= f32::MAX { beyond } else { 0 };
        }
        for i in 0..L {
            flags[i] = Flags::from_bits_retain(flags[i].bits() | found[i] as u16);
        }
    }
}

/// The flags that there are, with those of counts that are not sure.
pub(crate) fn flag_unsure(given: &[Flags], confidence: &[f32], least: f64, flags: &mut [Flags]) {
    let least = least_single(least);
    with_wide_registers(
        #[inline(always)]
        || {
            in_lanes(
                flags.len(),
                #[inline(always)]
                |start, lanes| {
                    if lanes {
                        unsure::<LANES>(start, given, confidence, least, flags);
                    } else {
                        unsure::<1>(start, given, confidence, least, flags);
                    }
                },
            );
        },
    );
}

/// `L` pixels from `start` on.
#[inline(always)]
fn unsure<const L: usize>(start: usize, given: &[Flags], confidence: &[f32], least: f32, flags: &mut [Flags]) {
    let (Some(given), Some(confidence)) = (given[start..].first_chunk::<L>(), confidence[start..].first_chunk::<L>())
    else {
        return;
    };
    let Some(flags) = flags[start..].first_chunk_mut::<L>() else { return };
    let mut found = [0_u32; L];
    for i in 0..L {
        found[i] = if confidence[i] >= least { 0 } else { u32::from(Flags::UNWRAP_UNSURE.bits()) };
    }
    for i in 0..L {
        flags[i] = Flags::from_bits_retain(given[i].bits() | found[i] as u16);
    }
}
