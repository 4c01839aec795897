//! Counts and sums over blocks of pixels.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use crate::correction::kernel::{LANES, Lanes, Mask};
use crate::summary::{DELAY, GROUPS, TOTAL, Tally};

/// Sums that are kept beside each other: so few stay in registers.
const SUMS: usize = 8;

/// Counts and sums of a row; where nobody asks for them, nothing is counted.
pub(crate) struct LaneTally<const COUNTS: bool> {
    finite: usize,
    corrected: usize,
    outside_span: usize,
    sum: [[f32; SUMS]; GROUPS],
    /// Bits of the largest absolute value, which grow with it.
    largest: [[u32; SUMS]; GROUPS],
    /// Of straight lines, whose sum is known without adding.
    delay_of_lines: f64,
}

impl<const COUNTS: bool> LaneTally<COUNTS> {
    pub(crate) fn new() -> Self {
        Self {
            finite: 0,
            corrected: 0,
            outside_span: 0,
            sum: [[0.0; SUMS]; GROUPS],
            largest: [[0; SUMS]; GROUPS],
            delay_of_lines: 0.0,
        }
    }

    /// Counts a block all of whose pixels are corrected.
    #[inline(always)]
    pub(crate) fn count_all(&mut self) {
        if !COUNTS {
            return;
        }
        self.finite += LANES;
        self.corrected += LANES;
    }

    #[inline(always)]
    pub(crate) fn count(&mut self, finite: &Mask, corrected: &Mask, outside_span: &Mask) {
        if !COUNTS {
            return;
        }
        // All bits are minus one.
        let count = |masks: &Mask| masks.iter().fold(0_u32, |sum, mask| sum.wrapping_sub(*mask)) as usize;
        self.finite += count(finite);
        self.corrected += count(corrected);
        self.outside_span += count(outside_span);
    }

    /// Adds one group of `Δρ`, zero where nothing was corrected.
    #[inline(always)]
    pub(crate) fn add(&mut self, group: usize, correction: &Lanes) {
        if !COUNTS {
            return;
        }
        let (sum, largest) = (&mut self.sum[group], &mut self.largest[group]);
        for values in correction.as_chunks::<SUMS>().0 {
            for lane in 0..SUMS {
                sum[lane] += values[lane];
                largest[lane] = largest[lane].max(magnitude_bits(values[lane]));
            }
        }
    }

    /// Notes the largest sum of all groups; what they add up to follows from the groups.
    #[inline(always)]
    pub(crate) fn add_total(&mut self, total: &Lanes) {
        if !COUNTS {
            return;
        }
        let largest = &mut self.largest[TOTAL];
        for values in total.as_chunks::<SUMS>().0 {
            for lane in 0..SUMS {
                largest[lane] = largest[lane].max(magnitude_bits(values[lane]));
            }
        }
    }

    /// Adds a delay that is a straight line over a block all of whose pixels are corrected.
    #[inline(always)]
    pub(crate) fn add_line(&mut self, delay: &Lanes) {
        if !COUNTS {
            return;
        }
        let ends = [delay[0], delay[LANES - 1]];
        self.delay_of_lines += LANES as f64 * f64::midpoint(f64::from(ends[0]), f64::from(ends[1]));
        for (largest, end) in self.largest[DELAY].iter_mut().zip(ends) {
            *largest = (*largest).max(magnitude_bits(end));
        }
    }

    /// Adds the lanes up in their order; `d0` is what each corrected pixel has of the total beside the groups.
    pub(crate) fn total(&self, d0: f64) -> Tally {
        let largest = |lanes: [u32; SUMS]| f64::from(f32::from_bits(lanes.into_iter().max().unwrap_or(0)));
        let mut sum = self.sum.map(|lanes| lanes.iter().map(|lane| f64::from(*lane)).sum());
        sum[DELAY] += self.delay_of_lines;
        sum[TOTAL] = self.corrected as f64 * d0
            + sum.iter().enumerate().filter(|(group, _)| *group != TOTAL).map(|(_, sum)| sum).sum::<f64>();
        Tally {
            finite: self.finite,
            corrected: self.corrected,
            outside_span: self.outside_span,
            sum,
            largest: self.largest.map(largest),
        }
    }
}

#[inline(always)]
fn magnitude_bits(value: f32) -> u32 {
    value.to_bits() & (u32::MAX >> 1)
}
