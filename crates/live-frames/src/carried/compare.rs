//! Counts of the frame held against those of its small image.
// Only what is inlined is compiled for wide registers; loops over lanes read as their formulas, without branches.
#![allow(clippy::inline_always, clippy::needless_range_loop, clippy::needless_bitwise_bool)]

use std::f32::consts::TAU;

use phase_unwrap::wrapped;
use range_image::{Raster, with_wide_registers};

use crate::carried::coarse::Coarse;
use crate::carried::pixels::{HELD, OPEN, RIM, is_gentle};

/// Confidence of the small image from which a pixel that took its count is as sure at once; below it the next check must agree first.
const CLEAR: f32 = 0.9;
/// Adding and taking off 1.5 * 2^23 rounds to an integer.
const ROUND: f32 = 12_582_912.0;

/// Planes of the frame.
pub(crate) struct Compared<'a> {
    pub phase: &'a Raster<f32>,
    pub amplitude: &'a Raster<f32>,
    pub state: &'a mut [u8],
    pub unwrapped: &'a mut [f32],
    pub before: &'a mut [f32],
    pub wraps: &'a mut [i32],
    pub confidence: &'a mut [f32],
    /// Phases and confidences of the small image, a value for each pixel of a row.
    pub spread: &'a mut [Vec<f32>; 2],
    /// Blocks of a row in which pixels contradict or have no count: the column where each begins, and those pixels, a bit each.
    pub settled: &'a mut Vec<(usize, u32)>,
    pub noise2: f32,
    pub maximum_wraps: i32,
    pub minimum_confidence: f32,
}

/// What came of it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Outcome {
    /// Pixels that took a count that is not sure.
    pub doubted: usize,
    /// Pixels whose own count was another.
    pub mended: usize,
}

impl Compared<'_> {
    /// Pixels that agree are as sure as the small image, if they were not surer. Those that contradict it take its count where they have the
    /// phase and the amplitude of what it shows there, and so do those without a count. Of others it says nothing: at edges it mixes
    /// surfaces, and belongs to neither.
    pub fn check(&mut self, coarse: &Coarse) -> Outcome {
        let (width, height) = (self.phase.width(), self.phase.height());
        let (mut outcome, mut settled) = (Outcome::default(), std::mem::take(self.settled));
        for row in 0..height {
            if row % coarse.factor == 0 {
                self.spread_row(coarse, row / coarse.factor, width);
            }
            let at = row * width..(row + 1) * width;
            let [spread, sure] = &*self.spread;
            let mut compared = Row {
                spread: &spread[..width],
                sure: &sure[..width],
                phase: &self.phase.as_slice()[at.clone()],
                wraps: &self.wraps[at.clone()],
                state: &self.state[at.clone()],
                confidence: &mut self.confidence[at.clone()],
            };
            let least = self.minimum_confidence;
            settled.clear();
            with_wide_registers(
                #[inline(always)]
                || compared.check(least, &mut settled),
            );
            for block in settled.drain(..) {
                self.settle(row, coarse, block, &mut outcome);
            }
        }
        *self.settled = settled;
        outcome
    }

    /// Pixels of a block of a row that contradict or have no count.
    fn settle(&mut self, row: usize, coarse: &Coarse, (start, mut left): (usize, u32), outcome: &mut Outcome) {
        let first = row * self.phase.width();
        let amplitudes = coarse.amplitudes(row / coarse.factor);
        while left != 0 {
            let column = start + left.trailing_zeros() as usize;
            left &= left - 1;
            let pixel = first + column;
            let open = self.state[pixel] == OPEN;
            let [spread, sure] = &*self.spread;
            let (spread, sure) = (spread[column], sure[column]);
            let (phase, amplitude) = (self.phase.as_slice()[pixel], self.amplitude.as_slice()[pixel]);
            let count = ((spread - phase) / TAU).round();
            if !(0.0..=self.maximum_wraps as f32).contains(&count) {
                continue;
            }
            let same =
                is_gentle(wrapped(phase - spread).abs(), [amplitude, amplitudes[column / coarse.factor]], self.noise2);
            if !open && !same {
                continue;
            }
            let clear = if open { same } else { sure >= CLEAR };
            self.wraps[pixel] = count as i32;
            self.unwrapped[pixel] = phase + TAU * count;
            self.before[pixel] = amplitude;
            self.confidence[pixel] = if clear { sure } else { 0.0 };
            self.state[pixel] = HELD;
            outcome.mended += usize::from(!open);
            outcome.doubted += usize::from(!clear);
        }
    }

    /// Unwrapped phases and confidences of the small image, for each pixel of the rows that one of its rows stands for.
    fn spread_row(&mut self, coarse: &Coarse, row: usize, width: usize) {
        let [phase, confidence] = coarse.row(row);
        let [spread, sure] = self.spread;
        for (block, ((phase, confidence), wraps)) in phase.iter().zip(confidence).zip(coarse.wraps(row)).enumerate() {
            let at = block * coarse.factor..((block + 1) * coarse.factor).min(width);
            spread[at.clone()].fill(phase + TAU * *wraps as f32);
            sure[at].fill(*confidence);
        }
    }
}

/// A row of the frame beside what its small image says of it.
struct Row<'a> {
    spread: &'a [f32],
    sure: &'a [f32],
    phase: &'a [f32],
    wraps: &'a [i32],
    state: &'a [u8],
    confidence: &'a mut [f32],
}

/// Pixels taken at a time, so that the compiler can vectorise.
const LANES: usize = 32;

impl Row<'_> {
    /// Compares all pixels, and lists the blocks in which any contradicts or has no count.
    #[inline(always)]
    fn check(&mut self, least: f32, settled: &mut Vec<(usize, u32)>) {
        let whole = self.phase.len() / LANES * LANES;
        for start in (0..whole).step_by(LANES) {
            let any = self.pixels::<LANES>(start, least).unwrap_or(0);
            if any != 0 {
                settled.push((start, any));
            }
        }
        let mut any = 0;
        for start in whole..self.phase.len() {
            any |= self.pixels::<1>(start, least).unwrap_or(0) << (start - whole);
        }
        if any != 0 {
            settled.push((whole, any));
        }
    }

    /// `L` pixels from `start` on: those that contradict or have no count, a bit each; `None` beyond the row.
    #[inline(always)]
    fn pixels<const L: usize>(&mut self, start: usize, least: f32) -> Option<u32> {
        let (spread, sure) = (self.spread[start..].first_chunk::<L>()?, self.sure[start..].first_chunk::<L>()?);
        let (phase, wraps) = (self.phase[start..].first_chunk::<L>()?, self.wraps[start..].first_chunk::<L>()?);
        let state = self.state[start..].first_chunk::<L>()?;
        let confidence = self.confidence[start..].first_chunk_mut::<L>()?;
        if agree(spread, phase, wraps, state) {
            for i in 0..L {
                confidence[i] = if confidence[i] > sure[i] { confidence[i] } else { sure[i] };
            }
            return Some(0);
        }
        // As wide as the values that they are compared with.
        let mut states = [0_u32; L];
        for i in 0..L {
            states[i] = u32::from(state[i]);
        }
        let mut any = [0_u32; L];
        for i in 0..L {
            let agrees = is_count(wraps[i], spread[i], phase[i]);
            let known = states[i] == u32::from(HELD);
            let aside = states[i] == u32::from(RIM);
            let own = confidence[i];
            let told = (sure[i] >= least) & !agrees & known;
            let kept = if own > sure[i] { own } else { sure[i] };
            confidence[i] = if agrees & (known | aside) { kept } else { own };
            any[i] = u32::from(told | (states[i] == u32::from(OPEN)));
        }
        Some(any.iter().enumerate().fold(0, |bits, (i, one)| bits | one << i))
    }
}

/// Whether all pixels hold and agree, as in nearly all blocks.
#[inline(always)]
fn agree<const L: usize>(spread: &[f32; L], phase: &[f32; L], wraps: &[i32; L], state: &[u8; L]) -> bool {
    let (mut other, mut all) = (0, u32::MAX);
    for i in 0..L {
        other |= state[i] ^ HELD;
    }
    for i in 0..L {
        all &= u32::from(is_count(wraps[i], spread[i], phase[i])).wrapping_neg();
    }
    (other == 0) & (all != 0)
}

/// Whether a count is the one that the small image gives a phase.
#[inline(always)]
fn is_count(wraps: i32, spread: f32, phase: f32) -> bool {
    let count = ((spread - phase) * (1.0 / TAU) + ROUND) - ROUND;
    (count - wraps as f32).abs() < 0.5
}
