//! Sums over pairs: in single precision within a chunk, in double precision over chunks in a fixed order.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// Lanes lie side by side: with an index, loops read as their formulas and have the same length everywhere.
#![allow(clippy::needless_range_loop)]

use rayon::prelude::*;

use rigid_pose::MotionEquations;

use crate::partners::locate::{Locate, WithLocate, run_wide, with_locate};
use crate::partners::pairs::{AT_ONCE, LANES, Moved, Pairs};
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
        for blocks in self.blocks.chunks(AT_ONCE) {
            let pairs = self.moved.pairs(locate, blocks.iter());
            add(&mut lanes, &pairs, &derivatives(&pairs.lever, &pairs.normal));
        }
        *self.sums = [0.0; SUMS];
        hand_over(self.sums, &lanes);
    }
}

/// Adds the sums of lanes to sums in double precision.
#[inline(always)]
pub(crate) fn hand_over<const N: usize>(sums: &mut [f64; N], lanes: &[[f32; BLOCK]; N]) {
    let (some, few) = lanes.as_chunks::<BLOCK>();
    let (some_sums, few_sums) = sums.as_chunks_mut::<BLOCK>();
    for (sums, lanes) in some_sums.iter_mut().zip(some) {
        let mut turned = [[0.0; BLOCK]; BLOCK];
        for l in 0..BLOCK {
            for k in 0..BLOCK {
                turned[l][k] = lanes[k][l];
            }
        }
        for k in 0..BLOCK {
            sums[k] += f64::from(across(&std::array::from_fn(|l| turned[l][k])));
        }
    }
    for (sum, lane) in few_sums.iter_mut().zip(few) {
        *sum += f64::from(across(lane));
    }
}

/// Sum over lanes, by halves: no lane waits for the one before.
#[inline(always)]
fn across([a, b, c, d, e, f, g, h]: &[f32; BLOCK]) -> f32 {
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

/// Adds pairs with their derivatives.
#[inline(always)]
pub fn add(sums: &mut [[f32; BLOCK]; SUMS], pairs: &Pairs, row: &[[f32; LANES]; 6]) {
    let mut k = 0;
    for r in 0..6 {
        let mut weighted = [0.0; LANES];
        for l in 0..LANES {
            weighted[l] = row[r][l] * pairs.weight[l];
        }
        for other in &row[r..] {
            add_products(&mut sums[k], &weighted, other);
            k += 1;
        }
        add_products(&mut sums[21 + r], &weighted, &pairs.residual);
    }
    let (mut square, mut one, mut count) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for l in 0..LANES {
        square[l] = pairs.residual[l] * pairs.residual[l];
        one[l] = 1.0;
        count[l] = if pairs.weight[l] > 0.0 { 1.0 } else { 0.0 };
    }
    add_products(&mut sums[27], &pairs.weight, &one);
    add_products(&mut sums[28], &pairs.weight, &square);
    add_products(&mut sums[29], &count, &one);
}

/// Adds products of lanes, block by block.
#[inline(always)]
pub(crate) fn add_products(sums: &mut [f32; BLOCK], a: &[f32; LANES], b: &[f32; LANES]) {
    let mut own = *sums;
    for block in 0..AT_ONCE {
        for l in 0..BLOCK {
            own[l] += a[block * BLOCK + l] * b[block * BLOCK + l];
        }
    }
    *sums = own;
}

/// Derivatives of the distance along `normal` by `[dt, rho w]`: the normal and lever x normal.
#[inline(always)]
pub(crate) fn derivatives(lever: &[[f32; LANES]; 3], normal: &[[f32; LANES]; 3]) -> [[f32; LANES]; 6] {
    let mut rows = [normal[0], normal[1], normal[2], [0.0; LANES], [0.0; LANES], [0.0; LANES]];
    for l in 0..LANES {
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
        parts.for_each(|(squares, blocks)| run_wide(SamplePart { moved, blocks, step, squares }, locate));
    }
}

/// The same of one part.
struct SamplePart<'a, 'b> {
    moved: &'a Moved<'b>,
    blocks: &'a [Block],
    step: usize,
    squares: &'a mut [u32],
}

impl WithLocate for SamplePart<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Locate>(self, locate: L) {
        let together = self.blocks.chunks(AT_ONCE * self.step).zip(self.squares.chunks_mut(LANES));
        for (blocks, squares) in together {
            let pairs = self.moved.pairs(locate, blocks.iter().step_by(self.step));
            let mut bits = [NO_PAIR; LANES];
            for k in 0..LANES {
                let square = positive_bits(pairs.residual[k] * pairs.residual[k] / pairs.variance[k]);
                bits[k] = if pairs.weight[k] > 0.0 { square } else { NO_PAIR };
            }
            squares.copy_from_slice(&bits[..squares.len()]);
        }
    }
}
