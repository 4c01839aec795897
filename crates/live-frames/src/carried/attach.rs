//! Pixels without a count take that of a neighbour: of one on the same surface, or at last of any.
// Only what is inlined is compiled for wide registers; loops over lanes read as their formulas, without branches.
#![allow(clippy::inline_always, clippy::needless_range_loop, clippy::needless_bitwise_bool)]

use std::f32::consts::TAU;

use range_image::with_wide_registers;

use crate::carried::pixels::{HELD, LANES, MASKED, OPEN, RIM, apart, is_gentle};
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
                for block in blocks.iter_mut().filter(|block| block.open != 0) {
                    let steps = self.steps(block);
                    let mut left = block.open;
                    while left != 0 {
                        let place = left.trailing_zeros();
                        left &= left - 1;
                        self.attach(block, place, &steps);
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
                for block in blocks.iter_mut().rev().filter(|block| block.open != 0) {
                    let steps = self.steps(block);
                    let mut left = block.open;
                    while left != 0 {
                        let place = left.ilog2();
                        left ^= 1 << place;
                        self.attach(block, place, &steps);
                    }
                }
            },
        );
    }

    /// The other sweeps, and the setting aside: pixels attached at edges have a count for this frame only. Gives the number of those
    /// that were attached, of those at edges, and of their neighbours that continue them with another count; lists those that are left.
    pub fn grow(&mut self, blocks: &mut [Block], open: &mut Vec<u32>) -> [usize; 3] {
        let left = |blocks: &[Block]| blocks.iter().map(|block| block.open.count_ones()).sum::<u32>();
        let mut before = left(blocks);
        for sweep in 1..SWEEPS {
            if sweep % 2 == 0 {
                self.sweep(blocks);
            } else {
                self.sweep_back(blocks);
            }
            let now = left(blocks);
            if now == before {
                break;
            }
            before = now;
        }
        let mut counts = [0; 3];
        with_wide_registers(
            #[inline(always)]
            || {
                for block in blocks.iter() {
                    let [at_edge, contested] = if block.attached == 0 { [0; 2] } else { self.set_aside(block) };
                    counts[2] += contested as usize;
                    counts[1] += at_edge.count_ones() as usize;
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

    /// Sizes of the steps to the pixels above, to the left, to the right and below where those may lie on the same surface: as patterns
    /// of bits, which sort as the steps do; all bits where they may not.
    #[inline(always)]
    fn steps(&self, block: &Block) -> [[u32; LANES]; 4] {
        let own = [here(self.phase, block.first as usize), here(self.amplitude, block.first as usize)];
        let mut steps = [[u32::MAX; LANES]; 4];
        for (steps, side) in steps.iter_mut().zip(self.sides(block)) {
            let Some(side) = side else { continue };
            let other = [here(self.phase, side), here(self.amplitude, side)];
            for i in 0..LANES {
                let step = wrapped(own[0][i] - other[0][i]).abs();
                let gentle = is_gentle(step, [other[1][i], own[1][i]], self.noise2);
                steps[i] = if gentle { step.to_bits() } else { u32::MAX };
            }
        }
        if block.col == 0 {
            steps[1][0] = u32::MAX;
        }
        if let Some(last) = self.last(block) {
            steps[2][last] = u32::MAX;
        }
        steps
    }

    /// Gives an open pixel of a block the count that continues the neighbour with the smallest step among those that hold on the same
    /// surface, if there is one.
    #[inline(always)]
    fn attach(&mut self, block: &mut Block, place: u32, steps: &[[u32; LANES]; 4]) {
        let (pixel, place) = ((block.first + place) as usize, place as usize);
        let sides = [pixel.wrapping_sub(self.width), pixel.wrapping_sub(1), pixel + 1, pixel + self.width];
        let (mut least, mut other) = (u32::MAX, pixel);
        for i in 0..4 {
            let holds = self.state.get(sides[i]).is_some_and(|state| *state == HELD);
            let step = if holds { steps[i][place] } else { u32::MAX };
            other = if step < least { sides[i] } else { other };
            least = least.min(step);
        }
        if least == u32::MAX {
            return;
        }
        let own = self.phase[pixel];
        let wraps = self.wraps[other] + wrap_step(self.phase[other], own);
        if !(0..=self.maximum_wraps).contains(&wraps) {
            return;
        }
        self.wraps[pixel] = wraps;
        self.confidence[pixel] = self.confidence[other];
        self.unwrapped[pixel] = own + TAU * wraps as f32;
        self.before[pixel] = self.amplitude[pixel];
        self.state[pixel] = HELD;
        block.open ^= 1 << place;
        block.attached |= 1 << place;
    }

    /// A pixel with a neighbour on another surface may belong to that one, or to neither, as slivers and mixed pixels do: it has
    /// its count for this frame, and says that it is a guess. Gives those of the attached ones of a block that do, a bit each, and how
    /// many neighbours look like the same surface but have another count.
    #[inline(always)]
    fn set_aside(&mut self, block: &Block) -> [u32; 2] {
        let first = block.first as usize;
        let (phase, brightness, wraps) =
            (here(self.phase, first), here(self.amplitude, first), here(self.wraps, first));
        let mut edges = [0_u32; LANES];
        for (number, side) in self.sides(block).into_iter().enumerate() {
            let Some(side) = side else { continue };
            let (other, amplitude, counts) =
                (here(self.phase, side), here(self.amplitude, side), here(self.wraps, side));
            let mut state = here(self.state, side);
            match (number, block.col, self.last(block)) {
                (1, 0, _) => state[0] = MASKED,
                (2, _, Some(last)) => state[last] = MASKED,
                _ => {}
            }
            for i in 0..LANES {
                let unwrapped = [phase[i] + TAU * wraps[i] as f32, other[i] + TAU * counts[i] as f32];
                let apart = apart(unwrapped, [brightness[i], amplitude[i]], self.noise2);
                let state = u32::from(state[i]);
                let known = (state == u32::from(HELD)) | (state == u32::from(RIM));
                edges[i] |= u32::from((state == u32::from(OPEN)) | (known & apart));
            }
        }
        let at_edge = edges.iter().enumerate().fold(0, |bits, (i, edge)| bits | edge << i) & block.attached;
        let mut contested = 0;
        let mut left = at_edge;
        while left != 0 {
            let pixel = first + left.trailing_zeros() as usize;
            left &= left - 1;
            contested += self.contested(pixel);
            self.state[pixel] = RIM;
            self.unwrapped[pixel] = f32::NAN;
            self.confidence[pixel] = 0.0;
        }
        [at_edge, contested]
    }

    /// Number of a pixel's neighbours that look like the same surface but have another count.
    fn contested(&self, pixel: usize) -> u32 {
        let (own, brightness) = (self.phase[pixel], self.amplitude[pixel]);
        let differs = |other: usize| {
            let known = matches!(self.state[other], HELD | RIM);
            let (phase, amplitude) = (self.phase[other], [brightness, self.amplitude[other]]);
            let unwrapped = [own + TAU * self.wraps[pixel] as f32, phase + TAU * self.wraps[other] as f32];
            known
                && apart(unwrapped, amplitude, self.noise2)
                && is_gentle(wrapped(own - phase).abs(), amplitude, self.noise2)
        };
        self.neighbours(pixel).into_iter().flatten().map(|other| u32::from(differs(other))).sum()
    }

    /// Where the blocks above, to the left, to the right and below begin, as far as there is one.
    #[inline(always)]
    fn sides(&self, block: &Block) -> [Option<usize>; 4] {
        let first = block.first as usize;
        let below = first + self.width;
        [
            first.checked_sub(self.width),
            first.checked_sub(1),
            Some(first + 1),
            Some(below).filter(|below| *below < self.phase.len()),
        ]
    }

    /// Place of the row's last pixel in a block that holds it.
    #[inline(always)]
    fn last(&self, block: &Block) -> Option<usize> {
        Some(self.width - 1 - block.col as usize).filter(|last| *last < LANES)
    }

    /// The pixels above, to the left, to the right and below, as far as there are such.
    #[inline(always)]
    fn neighbours(&self, pixel: usize) -> [Option<usize>; 4] {
        let col = pixel % self.width;
        [
            pixel.checked_sub(self.width),
            pixel.checked_sub(1).filter(|_| col > 0),
            Some(pixel + 1).filter(|_| col + 1 < self.width),
            Some(pixel + self.width).filter(|below| *below < self.phase.len()),
        ]
    }

    /// The count that continues the neighbour with the smallest step among those that hold. The pixel itself does not hold.
    fn nearest(&self, pixel: usize) -> Option<i32> {
        let own = self.phase[pixel];
        let mut best = (f32::INFINITY, None);
        for other in self.neighbours(pixel).into_iter().flatten().filter(|&other| self.state[other] == HELD) {
            let step = wrapped(own - self.phase[other]).abs();
            if step < best.0 {
                best = (step, Some(self.wraps[other] + wrap_step(self.phase[other], own)));
            }
        }
        best.1
    }
}

/// Values of the pixels of a block; nothing beyond the image.
#[inline(always)]
fn here<T: Copy + Default>(plane: &[T], first: usize) -> [T; LANES] {
    if let Some(values) = plane.get(first..).and_then(|values| values.first_chunk()) {
        return *values;
    }
    std::array::from_fn(|i| plane.get(first + i).copied().unwrap_or_default())
}
