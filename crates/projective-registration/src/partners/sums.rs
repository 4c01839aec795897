//! Sums over pairs: in single precision within a chunk, in double precision over chunks in a fixed order.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// Lanes lie side by side: with an index, loops read as their formulas and have the same length everywhere.
#![allow(clippy::needless_range_loop)]

use rayon::prelude::*;

use rigid_pose::MotionEquations;

use crate::partners::locate::{Locate, WithLocate, run_wide, with_locate};
use crate::partners::pairs::{Moved, Pairs};
use crate::preparation::bits::{median_of_bits, positive_bits};
use crate::preparation::blocks::Block;
use crate::preparation::grid::BLOCK;

/// Blocks of a chunk: sums in single precision stay short.
pub(crate) const CHUNK: usize = 32;
/// Chunks that one thread takes at least.
const CHUNKS_PER_TASK: usize = 4;
/// 21 products of the derivatives, 6 with the residual, and the sums of weight, weighted squares and pairs.
pub(crate) const SUMS: usize = 30;

/// Normal equations of motions `[dt, rho w]` about the centre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Normal {
    pub equations: MotionEquations,
    /// Sum of the weights, 1/m².
    pub weight: f64,
    /// Weighted sum of the squared residuals.
    pub square: f64,
    pub pairs: usize,
}

/// Sums over blocks of the source.
pub(crate) fn normal_equations(moved: &Moved<'_>, blocks: &[Block], chunks: &mut Vec<[f64; SUMS]>) -> Normal {
    chunks.resize(blocks.len().div_ceil(CHUNK), [0.0; SUMS]);
    with_locate(moved.target, AllChunks { moved, blocks, chunks });
    let mut total = [0.0; SUMS];
    for chunk in chunks.iter() {
        for (t, c) in total.iter_mut().zip(chunk) {
            *t += c;
        }
    }
    Normal::new(&total)
}

impl Normal {
    pub(crate) fn new(sums: &[f64; SUMS]) -> Self {
        let equations =
            MotionEquations::from_sums(&std::array::from_fn(|k| sums[k]), &std::array::from_fn(|k| sums[21 + k]));
        Self { equations, weight: sums[27], square: sums[28], pairs: sums[29] as usize }
    }
}

struct AllChunks<'a, 'b> {
    moved: &'a Moved<'b>,
    blocks: &'a [Block],
    chunks: &'a mut [[f64; SUMS]],
}

impl WithLocate for AllChunks<'_, '_> {
    type Output = ();

    fn run<L: Locate>(self, locate: L) {
        let moved = self.moved;
        let work = |(sums, blocks): (&mut [f64; SUMS], &[Block])| {
            run_wide(Chunk { moved, blocks, sums }, locate);
        };
        if self.chunks.len() < 2 * CHUNKS_PER_TASK {
            self.chunks.iter_mut().zip(self.blocks.chunks(CHUNK)).for_each(work);
        } else {
            let chunks = self.chunks.par_iter_mut().zip(self.blocks.par_chunks(CHUNK));
            chunks.with_min_len(CHUNKS_PER_TASK).with_max_len(2 * CHUNKS_PER_TASK).for_each(work);
        }
    }
}

struct Chunk<'a, 'b> {
    moved: &'a Moved<'b>,
    blocks: &'a [Block],
    sums: &'a mut [f64; SUMS],
}

impl WithLocate for Chunk<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Locate>(self, locate: L) {
        let mut lanes = [[0.0_f32; BLOCK]; SUMS];
        for block in self.blocks {
            let pairs = self.moved.pairs(locate, block);
            add(&mut lanes, &pairs, &derivatives(&pairs.lever, &pairs.normal));
        }
        *self.sums = [0.0; SUMS];
        hand_over(self.sums, &lanes);
    }
}

/// Adds the sums of lanes to sums in double precision.
#[inline(always)]
pub(crate) fn hand_over<const N: usize>(sums: &mut [f64; N], lanes: &[[f32; BLOCK]; N]) {
    for (sum, lane) in sums.iter_mut().zip(lanes) {
        *sum += f64::from(across(lane));
    }
}

/// Sum over lanes, by halves: no lane waits for the one before.
#[inline(always)]
pub(crate) fn across(lanes: &[f32; BLOCK]) -> f32 {
    let mut sums = *lanes;
    let mut half = BLOCK / 2;
    while half > 0 {
        for l in 0..half {
            sums[l] += sums[l + half];
        }
        half /= 2;
    }
    sums[0]
}

/// Adds pairs with their derivatives.
#[inline(always)]
pub fn add(sums: &mut [[f32; BLOCK]; SUMS], pairs: &Pairs, row: &[[f32; BLOCK]; 6]) {
    let mut k = 0;
    for r in 0..6 {
        let mut weighted = [0.0; BLOCK];
        for l in 0..BLOCK {
            weighted[l] = row[r][l] * pairs.weight[l];
        }
        for other in &row[r..] {
            for l in 0..BLOCK {
                sums[k][l] += weighted[l] * other[l];
            }
            k += 1;
        }
        for l in 0..BLOCK {
            sums[21 + r][l] += weighted[l] * pairs.residual[l];
        }
    }
    for l in 0..BLOCK {
        sums[27][l] += pairs.weight[l];
        sums[28][l] += pairs.weight[l] * pairs.residual[l] * pairs.residual[l];
        sums[29][l] += if pairs.weight[l] > 0.0 { 1.0 } else { 0.0 };
    }
}

/// Derivatives of the distance along `normal` by `[dt, rho w]`: the normal and lever x normal.
#[inline(always)]
pub(crate) fn derivatives(lever: &[[f32; BLOCK]; 3], normal: &[[f32; BLOCK]; 3]) -> [[f32; BLOCK]; 6] {
    let mut rows = [normal[0], normal[1], normal[2], [0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]];
    for l in 0..BLOCK {
        let (q, n) = ([lever[0][l], lever[1][l], lever[2][l]], [normal[0][l], normal[1][l], normal[2][l]]);
        rows[3][l] = q[1] * n[2] - q[2] * n[1];
        rows[4][l] = q[2] * n[0] - q[0] * n[2];
        rows[5][l] = q[0] * n[1] - q[1] * n[0];
    }
    rows
}

/// Median of the absolute residuals, over their standard deviations, of about `most` nodes of the blocks; `None` where there
/// are no pairs.
pub(crate) fn median_residual(moved: &Moved<'_>, blocks: &[Block], most: usize, scratch: &mut Vec<u32>) -> Option<f64> {
    // Spread evenly over the blocks.
    let step = (blocks.len() * BLOCK).div_ceil(most.max(1)).max(1);
    scratch.clear();
    scratch.resize(blocks.len().div_ceil(step) * BLOCK, NO_PAIR);
    with_locate(moved.target, Sample { moved, blocks, step, squares: scratch });
    scratch.retain(|square| *square != NO_PAIR);
    median_of_bits(scratch).map(|square| f64::from(square.sqrt()))
}

/// Stands for a node without a partner: the bits of no number.
const NO_PAIR: u32 = u32::MAX;

/// Squared residuals over their variances, as bits, of every `step`-th block.
struct Sample<'a, 'b> {
    moved: &'a Moved<'b>,
    blocks: &'a [Block],
    step: usize,
    squares: &'a mut [u32],
}

impl WithLocate for Sample<'_, '_> {
    type Output = ();

    fn run<L: Locate>(self, locate: L) {
        let (moved, step) = (self.moved, self.step);
        let parts = self.squares.par_chunks_mut(2 * CHUNK * BLOCK).zip(self.blocks.par_chunks(2 * CHUNK * step));
        parts.for_each(|(squares, blocks)| {
            let mut places = squares.chunks_exact_mut(BLOCK);
            let work = |pairs: &Pairs| {
                let place = places.next().unwrap_or_default();
                for (k, square) in place.iter_mut().enumerate() {
                    if pairs.weight[k] > 0.0 {
                        *square = positive_bits(pairs.residual[k] * pairs.residual[k] / pairs.variance[k]);
                    }
                }
            };
            run_wide(Visit { moved, blocks, step, work }, locate);
        });
    }
}

/// Calls a function with the pairs of every `step`-th block.
struct Visit<'a, 'b, F> {
    moved: &'a Moved<'b>,
    blocks: &'a [Block],
    step: usize,
    work: F,
}

impl<F: FnMut(&Pairs)> WithLocate for Visit<'_, '_, F> {
    type Output = ();

    #[inline(always)]
    fn run<L: Locate>(mut self, locate: L) {
        for block in self.blocks.iter().step_by(self.step) {
            (self.work)(&self.moved.pairs(locate, block));
        }
    }
}
