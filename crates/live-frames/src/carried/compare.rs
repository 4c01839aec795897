//! Counts of the frame held against those of its small image.
// Only what is inlined is compiled for wide registers; loops over lanes read as their formulas, without branches.
#![allow(clippy::inline_always, clippy::needless_range_loop, clippy::needless_bitwise_bool)]

use std::f32::consts::TAU;

use range_image::{Raster, with_wide_registers};

use crate::carried::coarse::Coarse;
use crate::carried::pixels::{HELD, OPEN, RIM};

/// Checks in a row that contradict a pixel's count before it gives way. A single tree errs on single frames; with one check, the
/// counts would follow it. With more, what passed wrongly stays longer.
const CHECKS: u8 = 2;
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
    /// How often in a row each pixel was contradicted.
    pub doubts: &'a mut [u8],
    /// Phases and confidences of the small image, a value for each pixel of a row.
    pub spread: &'a mut [Vec<f32>; 2],
    /// Columns where blocks of a row begin in which pixels contradict or have no count.
    pub settled: &'a mut Vec<usize>,
    pub maximum_wraps: i32,
    pub minimum_confidence: f32,
}

/// What came of it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Outcome {
    pub doubted: usize,
    pub mended: usize,
}

impl Compared<'_> {
    /// Pixels that agree are as sure as the small image, if they were not surer; those that contradict it are not sure, and give way
    /// when they did often enough; those without a count take its.
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
                doubts: &mut self.doubts[at.clone()],
            };
            let least = self.minimum_confidence;
            settled.clear();
            with_wide_registers(
                #[inline(always)]
                || compared.check(least, &mut settled),
            );
            for start in settled.drain(..) {
                self.settle(at.start, start..(start + LANES).min(width), &mut outcome);
            }
        }
        *self.settled = settled;
        outcome
    }

    /// Pixels that contradict or have no count, among some of the row whose first pixel is given.
    fn settle(&mut self, first: usize, columns: std::ops::Range<usize>, outcome: &mut Outcome) {
        for column in columns {
            let pixel = first + column;
            let open = self.state[pixel] == OPEN;
            if !open && self.doubts[pixel] == 0 {
                continue;
            }
            let [spread, sure] = &*self.spread;
            let (phase, sure) = (self.phase.as_slice()[pixel], sure[column]);
            let count = ((spread[column] - phase) / TAU).round();
            if !(0.0..=self.maximum_wraps as f32).contains(&count) {
                continue;
            }
            if open || self.doubts[pixel] >= CHECKS {
                self.wraps[pixel] = count as i32;
                self.unwrapped[pixel] = phase + TAU * count;
                self.before[pixel] = self.amplitude.as_slice()[pixel];
                self.confidence[pixel] = sure;
                self.doubts[pixel] = 0;
                self.state[pixel] = HELD;
                outcome.mended += usize::from(!open);
            } else {
                self.confidence[pixel] = 0.0;
                outcome.doubted += 1;
            }
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
    doubts: &'a mut [u8],
}

/// Pixels taken at a time, so that the compiler can vectorise.
const LANES: usize = 32;

impl Row<'_> {
    /// Compares all pixels, and lists where blocks begin in which any contradicts or has no count.
    #[inline(always)]
    fn check(&mut self, least: f32, settled: &mut Vec<usize>) {
        let whole = self.phase.len() / LANES * LANES;
        for start in (0..whole).step_by(LANES) {
            if self.pixels::<LANES>(start, least).unwrap_or(0) != 0 {
                settled.push(start);
            }
        }
        let mut any = 0;
        for start in whole..self.phase.len() {
            any |= self.pixels::<1>(start, least).unwrap_or(0);
        }
        if any != 0 {
            settled.push(whole);
        }
    }

    /// `L` pixels from `start` on; `None` beyond the row.
    #[inline(always)]
    fn pixels<const L: usize>(&mut self, start: usize, least: f32) -> Option<u32> {
        let (spread, sure) = (self.spread[start..].first_chunk::<L>()?, self.sure[start..].first_chunk::<L>()?);
        let (phase, wraps) = (self.phase[start..].first_chunk::<L>()?, self.wraps[start..].first_chunk::<L>()?);
        let state = self.state[start..].first_chunk::<L>()?;
        let confidence = self.confidence[start..].first_chunk_mut::<L>()?;
        let doubts = self.doubts[start..].first_chunk_mut::<L>()?;
        if agree(spread, phase, wraps, state, doubts) {
            for i in 0..L {
                confidence[i] = if confidence[i] > sure[i] { confidence[i] } else { sure[i] };
            }
            return Some(0);
        }
        // As wide as the values that they are compared with.
        let (mut states, mut counted) = ([0_u32; L], [0_u32; L]);
        for i in 0..L {
            states[i] = u32::from(state[i]);
            counted[i] = u32::from(doubts[i]) + 1;
        }
        let mut any = [0_u32; L];
        for i in 0..L {
            let agrees = is_count(wraps[i], spread[i], phase[i]);
            let known = states[i] == u32::from(HELD);
            let aside = (states[i] == u32::from(RIM)) & agrees;
            let own = confidence[i];
            let told = (sure[i] >= least) & !agrees & known;
            let kept = if own > sure[i] { own } else { sure[i] };
            confidence[i] = if (agrees & known) | aside { kept } else { own };
            counted[i] = if told { counted[i] } else { 0 };
            any[i] = counted[i] | u32::from(states[i] == u32::from(OPEN));
        }
        for i in 0..L {
            doubts[i] = counted[i] as u8;
        }
        Some(any.iter().fold(0, |all, one| all | one))
    }
}

/// Whether all pixels hold, agree and were not contradicted before, as in nearly all blocks.
#[inline(always)]
fn agree<const L: usize>(
    spread: &[f32; L],
    phase: &[f32; L],
    wraps: &[i32; L],
    state: &[u8; L],
    doubts: &[u8; L],
) -> bool {
    let (mut other, mut all) = (0, u32::MAX);
    for i in 0..L {
        other |= (state[i] ^ HELD) | doubts[i];
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
