//! The loop over the pixels that tests their samples.
// Only what is inlined is compiled for wide registers; branches would keep loops scalar, and lanes are counted in several
// planes at once.
#![allow(clippy::inline_always, clippy::needless_bitwise_bool, clippy::needless_range_loop)]

use rayon::prelude::*;

use crate::Flags;
use crate::demodulation::samples::{Sample, SampleBlock, Sums, peaks};
use crate::demodulation::weights::{GROUP, StepWeight};
use crate::rasters::wide::{Arithmetic, PixelLoop, run_wide, task_length};
use crate::sample_checks::sample_rules::SampleRules;

/// What the loop is for.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Purpose {
    /// To see whether there is a plateau; the flags stay.
    Count,
    /// To flag pixels.
    Flag,
}

/// Numbers of pixels.
#[derive(Clone, Copy, Default)]
pub(crate) struct Found {
    /// With samples at all frequencies, none of them saturated.
    pub(crate) checked: usize,
    /// Of these, those that break the rules.
    pub(crate) inconsistent: usize,
    /// With a saturated sample.
    pub(crate) saturated: usize,
    /// Of these, those that break the rules or have such a sample three times.
    pub(crate) evident: usize,
    /// Others of these, with both a highest and a lowest sample.
    pub(crate) at_both_ends: usize,
    /// The steps at which there are highest samples, a bit for each (modulo 64).
    pub(crate) steps: u64,
}

impl Found {
    fn plus(self, other: Self) -> Self {
        Self {
            checked: self.checked + other.checked,
            inconsistent: self.inconsistent + other.inconsistent,
            saturated: self.saturated + other.saturated,
            evident: self.evident + other.evident,
            at_both_ends: self.at_both_ends + other.at_both_ends,
            steps: self.steps | other.steps,
        }
    }
}

/// A frame's check.
#[derive(Clone, Copy)]
pub(crate) struct Job<'a> {
    pub(crate) rules: &'a SampleRules,
    pub(crate) weights: &'a [[StepWeight; GROUP]],
    pub(crate) steps: usize,
    /// Size of a sample that counts as saturated; NaN where none is stated.
    pub(crate) saturation: f32,
    /// Highest and lowest value where samples are cut off; NaN where they are not.
    pub(crate) plateau: [f32; 2],
}

impl Job<'_> {
    pub(crate) fn run<S: Sample>(&self, purpose: Purpose, samples: &[S], flags: &mut [Flags]) -> Found {
        let pixels = flags.len();
        let length = task_length(pixels);
        let parts = flags.par_chunks_mut(length).enumerate().map(|(index, flags)| {
            let first = index * length;
            run_wide(
                flags.len(),
                RulesLoop { job: *self, purpose, samples, pixels, first, flags, found: Found::default() },
            )
            .found
        });
        parts.reduce(Found::default, Found::plus)
    }
}

struct RulesLoop<'a, S> {
    job: Job<'a>,
    purpose: Purpose,
    samples: &'a [S],
    pixels: usize,
    first: usize,
    flags: &'a mut [Flags],
    found: Found,
}

/// What is known of some pixels: 1 for yes, 0 for no, lane by lane.
struct Verdicts<const L: usize> {
    broken: [u32; L],
    unknown: [u32; L],
    saturated: [u32; L],
    evident: [u32; L],
    both_ends: [u32; L],
    steps: u64,
}

impl<const L: usize> Verdicts<L> {
    const NONE: Self =
        Self { broken: [0; L], unknown: [0; L], saturated: [0; L], evident: [0; L], both_ends: [0; L], steps: 0 };
}

impl<S: Sample> PixelLoop for RulesLoop<'_, S> {
    #[inline(always)]
    fn pixels<A: Arithmetic, const L: usize>(&mut self, start: usize) {
        let mut verdicts = Verdicts::<L>::NONE;
        let length = self.job.steps * self.pixels;
        for samples in self.samples.chunks_exact(length) {
            let block = SampleBlock { samples, steps: self.job.steps, pixels: self.pixels, first: self.first };
            if judge::<A, S, L>(&self.job, &block, start, &mut verdicts).is_none() {
                return;
            }
        }
        let Some(flags) = self.flags[start..].first_chunk_mut::<L>() else { return };
        let mut found = [0_u32; 5];
        let keep = if self.purpose == Purpose::Flag { u32::MAX } else { 0 };
        for lane in 0..L {
            let bits = u32::from(flags[lane].bits());
            let saturated = verdicts.saturated[lane] | (bits & SATURATED);
            let checked = (1 - saturated) & (1 - verdicts.unknown[lane]);
            let broken = checked & verdicts.broken[lane];
            found[0] += checked;
            found[1] += broken;
            found[2] += saturated;
            let evident = verdicts.evident[lane] | (verdicts.saturated[lane] & verdicts.broken[lane]);
            found[3] += evident;
            found[4] += verdicts.both_ends[lane] & (1 - evident);
            let added = (broken * u32::from(Flags::MOTION.bits())) | (saturated * SATURATED);
            flags[lane] = Flags::from_bits_retain((bits | (added & keep)) as u16);
        }
        let [checked, inconsistent, saturated, evident, at_both_ends] = found.map(|count| count as usize);
        let steps = verdicts.steps;
        self.found = self.found.plus(Found { checked, inconsistent, saturated, evident, at_both_ends, steps });
    }
}

/// The flag that is bit 0.
const SATURATED: u32 = Flags::SATURATED.bits() as u32;

/// Adds what one frequency says; `None` beyond the block.
#[inline(always)]
fn judge<A: Arithmetic, S: Sample, const L: usize>(
    job: &Job<'_>,
    block: &SampleBlock<'_, S>,
    start: usize,
    verdicts: &mut Verdicts<L>,
) -> Option<()> {
    let sums = Sums::<L>::of::<A, S>(block, job.weights, start)?;
    let rest = squared_length::<A, S, L>(job.rules, block, start)?;
    let [none, linear, square] = job.rules.limit;
    let SampleRules { shot, dark, tolerance, .. } = *job.rules;
    for lane in 0..L {
        let power = A::multiply_add(sums.re[lane], sums.re[lane], sums.im[lane] * sums.im[lane]);
        let variance = A::multiply_add(shot, sums.mean[lane].max(0.0), dark);
        // The amplitude is at most the offset; noise may say otherwise.
        let modulation = (shot * shot * power / (variance * variance)).min(1.0);
        let limit = variance * A::multiply_add(modulation, A::multiply_add(modulation, square, linear), none);
        // (sqrt limit + tolerance A)^2 with one root.
        let systematic = tolerance * tolerance * power;
        let bound = limit + systematic + 2.0 * (limit * systematic).sqrt();
        verdicts.broken[lane] |= u32::from(rest[lane] > bound);
        verdicts.unknown[lane] |= u32::from(!(sums.mean[lane].is_finite() & rest[lane].is_finite()));
    }
    saturation::<S, L>(job, block, start, verdicts)
}

/// Squared length of what the samples hold beside offset, fundamental and known harmonics.
#[inline(always)]
fn squared_length<A: Arithmetic, S: Sample, const L: usize>(
    rules: &SampleRules,
    block: &SampleBlock<'_, S>,
    start: usize,
) -> Option<[f32; L]> {
    let mut total = [0.0; L];
    for component in rules.basis.chunks_exact(rules.groups) {
        let mut along = [0.0; L];
        for (group, weights) in component.iter().enumerate() {
            let planes = block.group::<L>(group, start)?;
            for lane in 0..L {
                let [a, b, c, d] = planes.map(|plane| plane[lane].value());
                let first = A::multiply_add(weights[0], a, weights[1] * b);
                along[lane] += first + A::multiply_add(weights[2], c, weights[3] * d);
            }
        }
        for lane in 0..L {
            total[lane] = A::multiply_add(along[lane], along[lane], total[lane]);
        }
    }
    Some(total)
}

/// Which pixels have a saturated sample, which have it three times, and which at both ends.
#[inline(always)]
fn saturation<S: Sample, const L: usize>(
    job: &Job<'_>,
    block: &SampleBlock<'_, S>,
    start: usize,
    verdicts: &mut Verdicts<L>,
) -> Option<()> {
    let mut peak = [0.0; L];
    let (mut high, mut low) = ([0_u32; L], [0_u32; L]);
    for group in 0..job.weights.len() {
        let planes = block.group::<L>(group, start)?;
        peak = peaks(planes, peak);
        for (step, plane) in (group * GROUP..job.steps).zip(planes) {
            let found = count(plane, job.plateau, &mut high, &mut low);
            verdicts.steps |= u64::from(found > 0) << (step % 64);
        }
    }
    for lane in 0..L {
        let (at_top, at_bottom) = (high[lane], low[lane]);
        verdicts.saturated[lane] |= u32::from((peak[lane] >= job.saturation) | (at_top + at_bottom > 0));
        verdicts.evident[lane] |= u32::from((at_top > 2) | (at_bottom > 2));
        verdicts.both_ends[lane] |= u32::from((at_top > 0) & (at_bottom > 0));
    }
    Some(())
}

/// Counts samples at both ends, and gives the number of the highest ones.
#[inline(always)]
fn count<S: Sample, const L: usize>(
    plane: &[S; L],
    [top, bottom]: [f32; 2],
    high: &mut [u32; L],
    low: &mut [u32; L],
) -> u32 {
    let mut total = 0;
    for lane in 0..L {
        let value = plane[lane].value();
        let at_top = u32::from(value >= top);
        high[lane] += at_top;
        low[lane] += u32::from(value <= bottom);
        total += at_top;
    }
    total
}
