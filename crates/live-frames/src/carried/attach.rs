//! Pixels without a count take that of a neighbour: of one on the same surface, or at last of any.
// Only what is inlined is compiled for wide registers; loops over lanes read as their formulas, without branches.
#![allow(clippy::inline_always, clippy::needless_range_loop, clippy::needless_bitwise_bool)]

use std::f32::consts::TAU;

use range_image::with_wide_registers;

use crate::carried::pixels::{HELD, LANES, OPEN, RIM, apart, is_gentle};
use phase_unwrap::{wrap_step, wrapped};

/// Sweeps forth and back over the pixels without a count. What is revealed at the edge of a surface is reached in the first;
/// more follow bends.
const SWEEPS: usize = 4;

/// Neighbouring pixels of a row, some of which had no count; fewer than `LANES` at its end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Block {
    /// Its first pixel.
    pub first: u32,
    /// Column of the first pixel.
    pub col: u32,
    /// Those that have no count yet, a bit each.
    pub open: u32,
    /// Those that were given a neighbour's.
    pub attached: u32,
}

/// A frame whose open pixels are to be attached.
pub(crate) struct Attaching<'a> {
    /// Columns.
    pub width: usize,
    pub phase: &'a [f32],
    pub amplitude: &'a [f32],
    pub state: &'a mut [u8],
    pub unwrapped: &'a mut [f32],
    pub before: &'a mut [f32],
    pub wraps: &'a mut [i32],
    pub confidence: &'a mut [f32],
    /// How often in a row each pixel was contradicted: with its count, a pixel takes over what speaks against it, so that a
    /// surface that moves through the image cannot escape.
    pub doubts: &'a mut [u8],
    pub noise2: f32,
    pub maximum_wraps: i32,
}

impl Attaching<'_> {
    /// The first sweep, over some blocks in their order: attaches their open pixels. The rows above must be done, and the states
    /// of the next one known.
    pub fn sweep(&mut self, blocks: &mut [Block]) {
        with_wide_registers(
            #[inline(always)]
            || {
                for block in blocks.iter_mut() {
                    let mut left = block.open;
                    while left != 0 {
                        let place = left.trailing_zeros();
                        left &= left - 1;
                        self.attach_in(block, place);
                    }
                }
            },
        );
    }

    /// The same from the last pixel to the first.
    fn sweep_back(&mut self, blocks: &mut [Block]) {
        with_wide_registers(
            #[inline(always)]
            || {
                for block in blocks.iter_mut().rev() {
                    let mut left = block.open;
                    while left != 0 {
                        let place = left.ilog2();
                        left ^= 1 << place;
                        self.attach_in(block, place);
                    }
                }
            },
        );
    }

    #[inline(always)]
    fn attach_in(&mut self, block: &mut Block, place: u32) {
        let (pixel, col) = ((block.first + place) as usize, (block.col + place) as usize);
        if self.attach(pixel, col) {
            block.open ^= 1 << place;
            block.attached |= 1 << place;
        }
    }

    /// The other sweeps, and the setting aside: pixels attached at edges have a count for this frame only. Gives the number of those
    /// that were attached, and of those at edges; lists those that are left.
    pub fn grow(&mut self, blocks: &mut [Block], open: &mut Vec<u32>) -> [usize; 2] {
        let left = |blocks: &[Block]| blocks.iter().map(|block| block.open.count_ones()).sum::<u32>();
        let mut before = left(blocks);
        for sweep in 1..SWEEPS {
            if sweep % 2 == 0 {
                self.sweep(blocks)
            } else {
                self.sweep_back(blocks)
            }
            let now = left(blocks);
            if now == before {
                break;
            }
            before = now;
        }
        let mut counts = [0; 2];
        with_wide_registers(
            #[inline(always)]
            || {
                for block in blocks.iter() {
                    let mut left = block.attached;
                    while left != 0 {
                        let place = left.trailing_zeros();
                        left &= left - 1;
                        let at_edge = self.set_aside((block.first + place) as usize, (block.col + place) as usize);
                        counts[1] += usize::from(at_edge);
                    }
                    counts[0] += block.attached.count_ones() as usize;
                }
            },
        );
        open.clear();
        for block in blocks.iter().filter(|block| block.open != 0) {
            let places = (0..LANES as u32).filter(|place| block.open >> place & 1 != 0);
            open.extend(places.map(|place| block.first + place));
        }
        counts
    }

    /// Gives each listed pixel the count that continues its likeliest neighbour, whatever lies between them. Its confidence
    /// is 0, and the next frame does not rest on it.
    pub fn guess(&mut self, open: &[u32]) {
        for &pixel in open {
            let pixel = pixel as usize;
            let wraps = self.nearest(pixel).unwrap_or(self.wraps[pixel]);
            self.wraps[pixel] = wraps.clamp(0, self.maximum_wraps);
            self.confidence[pixel] = 0.0;
            self.unwrapped[pixel] = f32::NAN;
            self.state[pixel] = RIM;
        }
    }

    /// Gives an open pixel the count that continues the neighbour with the smallest step among those that hold on the same surface;
    /// whether there is one.
    #[inline(always)]
    fn attach(&mut self, pixel: usize, col: usize) -> bool {
        let (own, brightness) = (self.phase[pixel], self.amplitude[pixel]);
        let sides = self.sides(pixel, col);
        let (phase, amplitude) = (sides.map(|side| self.phase[side]), sides.map(|side| self.amplitude[side]));
        let state = sides.map(|side| u32::from(self.state[side]));
        // Steps as patterns of bits, which sort as they do; all bits where a neighbour does not hold.
        let mut steps = [u32::MAX; 4];
        for i in 0..4 {
            let step = wrapped(own - phase[i]).abs();
            let holds = (state[i] == u32::from(HELD)) & is_gentle(step, [amplitude[i], brightness], self.noise2);
            steps[i] = if holds { step.to_bits() } else { u32::MAX };
        }
        let least = steps[0].min(steps[1]).min(steps[2].min(steps[3]));
        if least == u32::MAX {
            return false;
        }
        let other = sides[steps.iter().position(|step| *step == least).unwrap_or(0)];
        let wraps = self.wraps[other] + wrap_step(self.phase[other], own);
        if !(0..=self.maximum_wraps).contains(&wraps) {
            return false;
        }
        self.wraps[pixel] = wraps;
        self.confidence[pixel] = self.confidence[other];
        self.doubts[pixel] = self.doubts[other];
        self.unwrapped[pixel] = own + TAU * wraps as f32;
        self.before[pixel] = brightness;
        self.state[pixel] = HELD;
        true
    }

    /// A pixel with a neighbour on another surface may belong to that one, or to neither, as slivers and mixed pixels do: it has
    /// its count for this frame, and says that it is a guess.
    #[inline(always)]
    fn set_aside(&mut self, pixel: usize, col: usize) -> bool {
        let (brightness, sides) = (self.amplitude[pixel], self.sides(pixel, col));
        let own = self.phase[pixel] + TAU * self.wraps[pixel] as f32;
        let (phase, amplitude) = (sides.map(|side| self.phase[side]), sides.map(|side| self.amplitude[side]));
        let (state, wraps) = (sides.map(|side| u32::from(self.state[side])), sides.map(|side| self.wraps[side]));
        let mut edges = [0; 4];
        for i in 0..4 {
            let apart = apart([own, phase[i] + TAU * wraps[i] as f32], [brightness, amplitude[i]], self.noise2);
            let known = (state[i] == u32::from(HELD)) | (state[i] == u32::from(RIM));
            edges[i] = u32::from((state[i] == u32::from(OPEN)) | (known & apart));
        }
        let at_edge = edges.iter().fold(0, |any, edge| any | edge) != 0;
        if at_edge {
            self.state[pixel] = RIM;
            self.unwrapped[pixel] = f32::NAN;
            self.confidence[pixel] = 0.0;
        }
        at_edge
    }

    /// The neighbours of a pixel: above, to the left, to the right, below; the pixel itself where the image ends.
    #[inline(always)]
    fn sides(&self, pixel: usize, col: usize) -> [usize; 4] {
        let (width, count) = (self.width, self.phase.len());
        [
            if pixel >= width { pixel - width } else { pixel },
            if col > 0 { pixel - 1 } else { pixel },
            if col + 1 < width { pixel + 1 } else { pixel },
            if pixel + width < count { pixel + width } else { pixel },
        ]
    }

    /// The count that continues the neighbour with the smallest step among those that hold. The pixel itself does not hold.
    fn nearest(&self, pixel: usize) -> Option<i32> {
        let own = self.phase[pixel];
        let mut best = (f32::INFINITY, None);
        for other in self.sides(pixel, pixel % self.width).into_iter().filter(|&other| self.state[other] == HELD) {
            let step = wrapped(own - self.phase[other]).abs();
            if step < best.0 {
                best = (step, Some(self.wraps[other] + wrap_step(self.phase[other], own)));
            }
        }
        best.1
    }
}
