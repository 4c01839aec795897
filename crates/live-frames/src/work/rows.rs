//! From phases and counts to corrected points, row by row: what a row needs stays near while it is worked on.
// Only what is inlined is compiled for wide registers; loops over lanes read as their formulas, without branches.
#![allow(clippy::inline_always, clippy::needless_range_loop, clippy::needless_bitwise_bool)]

use std::slice::{Chunks, ChunksMut};

use camera_model::RayTable;
use error_models::{FrameRows, PreparedCorrection};
use phase_unwrap::{CombinedPixels, combine_pixels};
use range_image::{Flags, Raster, with_wide_registers};
use range_io::calibration::ValidSpan;
use rayon::prelude::*;

use crate::camera::MOST_FREQUENCIES;
use crate::error::Result;
use crate::frame::ProcessedFrame;
use crate::work::counts::metres;
use crate::work::planes::Planes;

/// A frame is cut into at most so many chunks of whole rows, whatever the threads.
const MOST_CHUNKS: usize = 64;

/// What all rows are worked on with.
pub(crate) struct Rules<'a> {
    pub(crate) rays: &'a RayTable,
    /// One a frequency; none where nothing is to be corrected.
    pub(crate) corrections: Option<&'a [PreparedCorrection]>,
    pub(crate) span: ValidSpan,
    /// Whether the whole frame lies outside of what the calibration rests on.
    pub(crate) all_outside: bool,
    pub(crate) minimum_confidence: f64,
    pub(crate) width: usize,
}

/// Ranges and deviations of each of several frequencies, and how well they agree.
#[derive(Debug)]
pub(crate) struct Frequencies {
    ranges: Vec<Raster<f32>>,
    sigmas: Vec<Raster<f32>>,
    chi_squared: Raster<f32>,
}

/// One frequency in some rows.
struct Channel<'a> {
    phase: &'a [f32],
    wraps: &'a [i32],
    amplitude: &'a [f32],
    /// Standard deviation of the phase; `None` where that of the range is there already.
    sigma_phase: Option<&'a [f32]>,
    range: &'a mut [f32],
    sigma: &'a mut [f32],
    metres: [f64; 2],
}

/// Some rows.
struct Chunk<'a> {
    first_row: usize,
    channels: [Option<Channel<'a>>; MOST_FREQUENCIES],
    confidence: &'a [f32],
    given: &'a [Flags],
    /// Where several frequencies are brought together.
    combined: Option<CombinedPixels<'a>>,
    points: &'a mut [[f64; 3]],
    flags: &'a mut [Flags],
    result: Result<()>,
}

impl Frequencies {
    /// Nothing for one.
    pub(crate) fn new(width: usize, height: usize, frequencies: usize) -> Self {
        let plane = Raster::filled(width, height, f32::NAN);
        let count = if frequencies > 1 { frequencies } else { 0 };
        let chi_squared = if frequencies > 1 { plane.clone() } else { Raster::default() };
        Self { ranges: vec![plane.clone(); count], sigmas: vec![plane; count], chi_squared }
    }
}

/// Takes all rows to corrected points.
pub(crate) fn finish(
    rules: &Rules<'_>,
    planes: &Planes,
    counts: (&[Raster<i32>], &Raster<f32>),
    frequencies: &mut Frequencies,
    frame: &mut ProcessedFrame,
) -> Result<()> {
    let mut cut = Cut::new(rules.width, planes, counts, frequencies, frame);
    let mut jobs: [Option<Chunk<'_>>; MOST_CHUNKS] = std::array::from_fn(|_| cut.next());
    if rayon::current_num_threads() == 1 {
        jobs.iter_mut().flatten().for_each(|chunk| chunk.result = chunk.run(rules));
    } else {
        jobs.par_iter_mut().flatten().for_each(|chunk| chunk.result = chunk.run(rules));
    }
    jobs.into_iter().flatten().try_for_each(|chunk| chunk.result)
}

/// All planes of a frame, cut into chunks one after the other.
struct Cut<'a> {
    rows: usize,
    width: usize,
    number: usize,
    planes: &'a Planes,
    wraps: &'a [Raster<i32>],
    amplitude: &'a Raster<f32>,
    ranges: [Option<ChunksMut<'a, f32>>; MOST_FREQUENCIES],
    sigmas: [Option<ChunksMut<'a, f32>>; MOST_FREQUENCIES],
    combined: Option<[ChunksMut<'a, f32>; 3]>,
    confidence: Chunks<'a, f32>,
    given: Chunks<'a, Flags>,
    points: ChunksMut<'a, [f64; 3]>,
    flags: ChunksMut<'a, Flags>,
}

impl<'a> Cut<'a> {
    fn new(
        width: usize,
        planes: &'a Planes,
        (wraps, confidence): (&'a [Raster<i32>], &'a Raster<f32>),
        frequencies: &'a mut Frequencies,
        frame: &'a mut ProcessedFrame,
    ) -> Self {
        let rows = frame.height().div_ceil(MOST_CHUNKS);
        let length = (rows * width).max(1);
        let ProcessedFrame { range, sigma, amplitude, flags, points, .. } = frame;
        let (mut ranges, mut sigmas) = ([const { None }; MOST_FREQUENCIES], [const { None }; MOST_FREQUENCIES]);
        let mut combined = None;
        let cut = |plane: &'a mut Raster<f32>| plane.as_mut_slice().chunks_mut(length);
        if planes.phases.len() > 1 {
            let Frequencies { ranges: of_range, sigmas: of_sigma, chi_squared } = frequencies;
            ranges.iter_mut().zip(of_range).for_each(|(to, plane)| *to = Some(cut(plane)));
            sigmas.iter_mut().zip(of_sigma).for_each(|(to, plane)| *to = Some(cut(plane)));
            combined = Some([cut(range), cut(sigma), cut(chi_squared)]);
        } else {
            (ranges[0], sigmas[0]) = (Some(cut(range)), Some(cut(sigma)));
        }
        Self {
            rows,
            width,
            number: 0,
            planes,
            wraps,
            amplitude,
            ranges,
            sigmas,
            combined,
            confidence: confidence.as_slice().chunks(length),
            given: planes.complex.flags.as_slice().chunks(length),
            points: points.chunks_mut(length),
            flags: flags.as_mut_slice().chunks_mut(length),
        }
    }

    fn next(&mut self) -> Option<Chunk<'a>> {
        let first_row = self.number * self.rows;
        self.number += 1;
        let channels = std::array::from_fn(|index| self.channel(index, first_row * self.width));
        let combined = match &mut self.combined {
            Some([range, sigma, chi_squared]) => {
                Some(CombinedPixels { range: range.next()?, sigma: sigma.next()?, chi_squared: chi_squared.next()? })
            }
            None => None,
        };
        Some(Chunk {
            first_row,
            channels,
            confidence: self.confidence.next()?,
            given: self.given.next()?,
            combined,
            points: self.points.next()?,
            flags: self.flags.next()?,
            result: Ok(()),
        })
    }

    /// One frequency from a pixel on; `None` beyond the last.
    fn channel(&mut self, index: usize, start: usize) -> Option<Channel<'a>> {
        let (range, sigma) = (self.ranges[index].as_mut()?.next()?, self.sigmas[index].as_mut()?.next()?);
        let (planes, own) = (self.planes, start..start + range.len());
        let amplitude = if index == 0 { self.amplitude } else { planes.further_amplitudes.get(index - 1)? };
        Some(Channel {
            phase: &planes.phases.get(index)?.as_slice()[own.clone()],
            wraps: &self.wraps.get(index)?.as_slice()[own.clone()],
            amplitude: &amplitude.as_slice()[own.clone()],
            sigma_phase: planes.sigmas.get(index).map(|plane| &plane.as_slice()[own]),
            range,
            sigma,
            metres: metres(&planes.complex.channels.get(index)?.modulation),
        })
    }
}

impl Chunk<'_> {
    fn run(&mut self, rules: &Rules<'_>) -> Result<()> {
        (0..self.flags.len() / rules.width).try_for_each(|row| self.row(row, rules))
    }

    fn row(&mut self, row: usize, rules: &Rules<'_>) -> Result<()> {
        let at = row * rules.width..(row + 1) * rules.width;
        let first_row = self.first_row + row;
        let flags = &mut self.flags[at.clone()];
        flag_unsure(&self.given[at.clone()], &self.confidence[at.clone()], rules.minimum_confidence, flags);
        for (index, channel) in self.channels.iter_mut().enumerate() {
            let Some(channel) = channel else { break };
            let correction = rules.corrections.and_then(|corrections| corrections.get(index));
            channel.fill(at.clone(), &Limits::new(rules, correction.is_some()), flags);
            let Some(correction) = correction else { continue };
            let (range, sigma) = (&mut channel.range[at.clone()], &mut channel.sigma[at.clone()]);
            let amplitude = &channel.amplitude[at.clone()];
            correction.correct_rows(first_row, FrameRows { range, sigma, amplitude, flags })?;
        }
        if let Some(out) = &mut self.combined {
            let mut ranges: [&[f32]; MOST_FREQUENCIES] = [&[]; MOST_FREQUENCIES];
            let mut sigmas = ranges;
            let mut count = 0;
            for channel in self.channels.iter().flatten() {
                ranges[count] = &channel.range[at.clone()];
                sigmas[count] = &channel.sigma[at.clone()];
                count += 1;
            }
            let out = CombinedPixels {
                range: &mut out.range[at.clone()],
                sigma: &mut out.sigma[at.clone()],
                chi_squared: &mut out.chi_squared[at.clone()],
            };
            combine_pixels(&ranges[..count], &sigmas[..count], out)?;
        }
        let own = self.channels.first().and_then(Option::as_ref).map(|channel| &*channel.range);
        let Some(range) = self.combined.as_ref().map(|out| &*out.range).or(own) else { return Ok(()) };
        let points = &mut self.points[at.clone()];
        Ok(rules.rays.back_project_pixels(first_row * rules.width, &range[at], points, flags)?)
    }
}

impl Channel<'_> {
    /// Ranges of a row from its phases and counts; what has no phase is not sure of its count, and what lies outside of the
    /// limits, by the ranges as they were observed, is flagged.
    fn fill(&mut self, at: std::ops::Range<usize>, limits: &Limits, flags: &mut [Flags]) {
        let mut row = Filled {
            metres: self.metres,
            phase: &self.phase[at.clone()],
            wraps: &self.wraps[at.clone()],
            amplitude: &self.amplitude[at.clone()],
            range: &mut self.range[at.clone()],
            flags,
        };
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
        let Some(sigma_phase) = self.sigma_phase else { return };
        let unit = self.metres[0] as f32;
        for (sigma, of_phase) in self.sigma[at.clone()].iter_mut().zip(&sigma_phase[at]) {
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
fn flag_unsure(given: &[Flags], confidence: &[f32], least: f64, flags: &mut [Flags]) {
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
