//! Samples of some neighbouring pixels, and their sums over the phase steps.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use crate::demodulation::weights::{GROUP, StepWeight};
use crate::rasters::wide::Arithmetic;

/// A sample of any of the types that sensors deliver; all are exact in f32.
pub(crate) trait Sample: Copy + Sync {
    /// The sample as a number.
    fn value(self) -> f32;
}

impl Sample for f32 {
    #[inline(always)]
    fn value(self) -> f32 {
        self
    }
}

impl Sample for u16 {
    #[inline(always)]
    fn value(self) -> f32 {
        f32::from(self)
    }
}

impl Sample for i16 {
    #[inline(always)]
    fn value(self) -> f32 {
        f32::from(self)
    }
}

/// The pixels from `first` on, in the planes of all steps of one frequency.
#[derive(Clone, Copy)]
pub(crate) struct SampleBlock<'a, S> {
    /// `[N, H, W]`.
    pub samples: &'a [S],
    /// Number N of planes.
    pub steps: usize,
    /// Pixels of a plane.
    pub pixels: usize,
    /// Where in a plane the block begins.
    pub first: usize,
}

impl<'a, S: Sample> SampleBlock<'a, S> {
    /// The samples of `L` pixels at the steps of a group; `start` counts from the beginning of the block. Where there
    /// is no such step, those of the last one, whose weight is zero. `None` beyond the block.
    #[inline(always)]
    pub(crate) fn group<const L: usize>(&self, group: usize, start: usize) -> Option<[&'a [S; L]; GROUP]> {
        let last = self.steps - 1;
        let plane = |step: usize| {
            let begin = step.min(last) * self.pixels + self.first + start;
            self.samples.get(begin..begin + L)?.first_chunk::<L>()
        };
        let first = group * GROUP;
        Some([plane(first)?, plane(first + 1)?, plane(first + 2)?, plane(first + 3)?])
    }
}

/// Sums over the steps for `L` pixels.
pub(crate) struct Sums<const L: usize> {
    /// Real part of `z`.
    pub re: [f32; L],
    /// Imaginary part of `z`.
    pub im: [f32; L],
    /// Offset.
    pub mean: [f32; L],
}

impl<const L: usize> Sums<L> {
    /// Adds up in the order of the steps; `None` beyond the block.
    #[inline(always)]
    pub(crate) fn of<A: Arithmetic, S: Sample>(
        block: &SampleBlock<'_, S>,
        weights: &[[StepWeight; GROUP]],
        start: usize,
    ) -> Option<Self> {
        let (first, further) = weights.split_first()?;
        let mut sums = Self { re: [0.0; L], im: [0.0; L], mean: [0.0; L] };
        let planes = block.group::<L>(0, start)?;
        for lane in 0..L {
            [sums.re[lane], sums.im[lane], sums.mean[lane]] =
                add::<A>([0.0; 3], first, planes.map(|plane| plane[lane].value()));
        }
        for (index, weights) in further.iter().enumerate() {
            let planes = block.group::<L>(index + 1, start)?;
            for lane in 0..L {
                let before = [sums.re[lane], sums.im[lane], sums.mean[lane]];
                [sums.re[lane], sums.im[lane], sums.mean[lane]] =
                    add::<A>(before, weights, planes.map(|plane| plane[lane].value()));
            }
        }
        Some(sums)
    }
}

/// Adds the samples of one pixel at the steps of a group.
#[inline(always)]
fn add<A: Arithmetic>(
    [mut re, mut im, mut mean]: [f32; 3],
    weights: &[StepWeight; GROUP],
    values: [f32; GROUP],
) -> [f32; 3] {
    for (weight, value) in weights.iter().zip(values) {
        re = A::multiply_add(weight.re, value, re);
        im = A::multiply_add(weight.im, value, im);
        mean = A::multiply_add(weight.mean, value, mean);
    }
    [re, im, mean]
}

/// Largest sample of each of `L` pixels in size.
#[inline(always)]
pub(crate) fn peaks<S: Sample, const L: usize>(planes: [&[S; L]; GROUP], mut peaks: [f32; L]) -> [f32; L] {
    for lane in 0..L {
        for plane in planes {
            let size = plane[lane].value().abs();
            peaks[lane] = if size > peaks[lane] { size } else { peaks[lane] };
        }
    }
    peaks
}
