//! The highest values of a frame, and whether the sensor was cut off there.
// Only what is inlined is compiled for wide registers; branches would keep loops scalar, and lanes are counted in several
// planes at once.
#![allow(clippy::inline_always, clippy::needless_bitwise_bool, clippy::needless_range_loop)]

use rayon::prelude::*;

use crate::PlateauOptions;
use crate::demodulation::samples::Sample;
use crate::rasters::wide::{Arithmetic, PixelLoop, run_wide, task_length};

/// Distinct values that are kept.
const KEPT: usize = 8;

/// The highest distinct values with their numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Highest {
    values: [f32; KEPT],
    counts: [usize; KEPT],
}

impl Default for Highest {
    fn default() -> Self {
        Self { values: [f32::NEG_INFINITY; KEPT], counts: [0; KEPT] }
    }
}

impl Highest {
    /// What is below need not be given.
    fn floor(&self) -> f32 {
        self.values[KEPT - 1]
    }

    fn add(&mut self, value: f32, count: usize) {
        if value < self.floor() || !value.is_finite() {
            return;
        }
        let place = self.values.partition_point(|kept| *kept > value);
        if self.values[place].to_bits() == value.to_bits() {
            self.counts[place] += count;
            return;
        }
        self.values[place..].rotate_right(1);
        self.counts[place..].rotate_right(1);
        (self.values[place], self.counts[place]) = (value, count);
    }

    /// The same for two parts of a frame together, whatever the parts.
    fn merged(mut self, other: Self) -> Self {
        for (value, count) in other.values.into_iter().zip(other.counts) {
            self.add(value, count);
        }
        self
    }

    /// The highest value where it towers above the next ones; a smooth distribution ends in a few values each.
    pub(crate) fn spike(&self, options: &PlateauOptions) -> Option<f32> {
        let others = self.counts[1..].iter().copied().max().unwrap_or(0);
        let towers = self.counts[0] as f64 >= options.ratio * others as f64;
        let full = self.counts.iter().all(|count| *count > 0);
        (full && towers && self.counts[0] >= options.least_samples).then_some(self.values[0])
    }
}

/// The highest values of all samples, and of their negatives those above zero.
pub(crate) fn highest<S: Sample>(samples: &[S]) -> [Highest; 2] {
    let none = || [Highest::default(); 2];
    let parts = samples.par_chunks(task_length(samples.len())).map(|samples| {
        let work = run_wide(samples.len(), HighestLoop { samples, found: none() });
        work.found
    });
    parts.reduce(none, |[top, bottom], [other_top, other_bottom]| [top.merged(other_top), bottom.merged(other_bottom)])
}

struct HighestLoop<'a, S> {
    samples: &'a [S],
    found: [Highest; 2],
}

impl<S: Sample> PixelLoop for HighestLoop<'_, S> {
    #[inline(always)]
    fn pixels<A: Arithmetic, const L: usize>(&mut self, start: usize) {
        let Some(samples) = self.samples[start..].first_chunk::<L>() else { return };
        let [top, bottom] = [self.found[0].floor(), -self.found[1].floor().max(f32::MIN_POSITIVE)];
        let mut hits = 0_u32;
        for lane in 0..L {
            let value = samples[lane].value();
            hits += u32::from((value >= top) | (value <= bottom));
        }
        if hits > 0 {
            self.keep(samples);
        }
    }
}

impl<S: Sample> HighestLoop<'_, S> {
    fn keep(&mut self, samples: &[S]) {
        let [top, bottom] = &mut self.found;
        for sample in samples {
            let value = sample.value();
            top.add(value, 1);
            if value < 0.0 {
                bottom.add(-value, 1);
            }
        }
    }
}
