//! What the pairs say about the pose: covariance, and a verdict on degeneracy.
//!
//! Neighbouring pairs share errors (directions of planes from overlapping windows, rounded creases), so scores are
//! summed over cells of the frame before they are squared: a cell counts as one observation. And the noise of the
//! normals imitates geometry: on one plane, n noisy normals say something about sliding that is not there. The errors
//! of source and target normals are independent, so their cross products tell the information without that bias, and
//! its scatter between the cells tells whether what is left differs from nothing.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// Lanes lie side by side: with an index, loops read as their formulas and have the same length everywhere.
#![allow(clippy::needless_range_loop)]

use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;

use crate::error::Result;
use crate::partners::locate::{Locate, WithLocate, run_wide, with_locate};
use crate::partners::pairs::{AT_ONCE, LANES, Moved, Pairs};
use crate::partners::sums::{self, Normal, derivatives};
use crate::preparation::blocks::Block;
use crate::preparation::grid::{BLOCK, MOST_CELLS};
use icp_registration::quality::{Directions, SIGNIFICANCE};
use rigid_pose::symmetric;

/// What stands out beside cells that carry no information: its multiple of their scatter, and of the middle cell for one that is none of them.
const CLEAR: f64 = 5.0;
/// Share of the largest information that rounding can imitate (single precision).
const ROUNDING: f64 = 1e-7;
/// Smallest variance of the scores as a share of what the noise of the nodes lets expect: independent frames show about a
/// half, as plane fits share their noise.
const LEAST_SCORE: f64 = 0.25;
/// Parts of the pairs, each with cells of its own, that threads may take.
const PARTS: usize = 4;
/// 6 scores and 21 products.
const SUMS: usize = 6 + 21;

/// Sums over the pairs of one cell.
pub(crate) type Cell = [f64; SUMS];

/// What the pairs say about the pose.
pub(crate) struct Verdict {
    pub(crate) directions: Directions,
    /// The normal equations of the same pairs.
    pub(crate) normal: Normal,
}

impl Verdict {
    /// Judges the blocks of the source; motions with a predicted sigma above `max_sigma_m` are undetermined.
    pub(crate) fn new(moved: &Moved<'_>, blocks: &[Block], max_sigma_m: f64, cells: &mut Vec<Cell>) -> Result<Self> {
        let (cells, normal) = fill(moved, blocks, cells);
        let information = symmetric(&cells.iter().fold([0.0; 21], |mut sum, cell| {
            sum.iter_mut().zip(&cell[6..]).for_each(|(s, c)| *s += c);
            sum
        }));
        let used = cells.iter().filter(|c| c[6] + c[12] + c[17] != 0.0).count();
        // Six cells and fewer stand out from nothing, whatever their scores.
        let score = clustered(cells) * (used as f64 / (used as f64 - 6.0).max(1.0));
        // Frames that are copies of each other leave no residuals: their noise is still that of their nodes.
        let missing = (LEAST_SCORE - score.trace() / normal.equations.matrix.trace()).max(0.0);
        let score = score + normal.equations.matrix * missing;
        let significant = |motion: &Vector6<f64>, information| is_significant(cells, information, motion);
        let directions = Directions::new(&information, |_| (score, 1.0), significant, ROUNDING, max_sigma_m)?;
        Ok(Self { directions, normal })
    }
}

/// Whether information stands out from what noise imitates.
///
/// Where all cells carry some, it does so from their scatter. Where few cells carry it all, as those of a small surface
/// before walls, they make up most of the scatter: then it has to stand out, more clearly and without the largest cell,
/// from the scatter of what most cells show.
fn is_significant(cells: &[Cell], information: f64, vector: &Vector6<f64>) -> bool {
    let mut each = [0.0; MOST_CELLS];
    let mut count = 0;
    for cell in cells.iter().filter(|cell| cell[6] + cell[12] + cell[17] != 0.0).take(MOST_CELLS) {
        each[count] = form(&cell[6..], vector);
        count += 1;
    }
    let each = &mut each[..count];
    if information > SIGNIFICANCE * each.iter().map(|f| f * f).sum::<f64>().sqrt() {
        return true;
    }
    each.sort_unstable_by(|a, b| a.abs().total_cmp(&b.abs()));
    let Some(middle) = each.get(count / 2) else { return false };
    let usual = CLEAR * middle.abs();
    let scatter = each.iter().map(|f| f.abs().min(usual).powi(2)).sum::<f64>().sqrt();
    let top = each.iter().copied().fold(0.0, f64::max);
    information - top > CLEAR * scatter
}

/// Covariance of the summed score from the scatter of its sums over cells.
fn clustered(cells: &[Cell]) -> Matrix6<f64> {
    cells.iter().fold(Matrix6::zeros(), |sum, cell| {
        let score = Vector6::from_fn(|i, _| cell[i]);
        sum + score * score.transpose()
    })
}

/// `v' M v` of a matrix given by its upper triangle.
fn form(upper: &[f64], v: &Vector6<f64>) -> f64 {
    let (mut sum, mut k) = (0.0, 0);
    for r in 0..6 {
        for c in r..6 {
            sum += upper[k] * v[r] * v[c] * if r == c { 1.0 } else { 2.0 };
            k += 1;
        }
    }
    sum
}

/// Sums over the cells, and the normal equations.
fn fill<'c>(moved: &Moved<'_>, blocks: &[Block], cells: &'c mut Vec<Cell>) -> (&'c [Cell], Normal) {
    let count = moved.source.grid.cell_count;
    cells.clear();
    cells.resize(PARTS * count, [0.0; SUMS]);
    let mut parts = [[0.0; sums::SUMS]; PARTS];
    with_locate(moved.target, Fill { moved, blocks, cells, parts: &mut parts });
    let (first, others) = cells.split_at_mut(count);
    for part in others.chunks(count) {
        for (cell, other) in first.iter_mut().zip(part) {
            cell.iter_mut().zip(other).for_each(|(c, o)| *c += o);
        }
    }
    let total = |k: usize| parts.iter().map(|part| part[k]).sum::<f64>();
    (first, Normal::new(&std::array::from_fn(total)))
}

struct Fill<'a, 'b> {
    moved: &'a Moved<'b>,
    blocks: &'a [Block],
    cells: &'a mut [Cell],
    parts: &'a mut [[f64; sums::SUMS]; PARTS],
}

impl WithLocate for Fill<'_, '_> {
    type Output = ();

    fn run<L: Locate>(self, locate: L) {
        let moved = self.moved;
        let size = self.blocks.len().div_ceil(PARTS).max(1);
        let sums = self.cells.par_chunks_mut(self.cells.len() / PARTS).zip(self.parts.par_iter_mut());
        let blocks = self.blocks.par_chunks(size).zip(moved.source.grid.cells.par_chunks(size));
        sums.zip(blocks).for_each(|((cells, totals), (blocks, cell_of))| {
            run_wide(Part { moved, blocks, cell_of, cells, totals }, locate);
        });
    }
}

struct Part<'a, 'b> {
    moved: &'a Moved<'b>,
    blocks: &'a [Block],
    /// Cells of the nodes.
    cell_of: &'a [[u16; BLOCK]],
    cells: &'a mut [Cell],
    totals: &'a mut [f64; sums::SUMS],
}

impl WithLocate for Part<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Locate>(mut self, locate: L) {
        let mut run = Run { cell: 0, lanes: [[0.0; BLOCK]; SUMS], each: [[0.0; LANES]; SUMS] };
        for (blocks, cells) in self.blocks.chunks(sums::CHUNK).zip(self.cell_of.chunks(sums::CHUNK)) {
            let mut totals = [[0.0; BLOCK]; sums::SUMS];
            for (blocks, cells) in blocks.chunks(AT_ONCE).zip(cells.chunks(AT_ONCE)) {
                let pairs = self.moved.pairs(locate, blocks.iter());
                self.add(&mut run, &mut totals, &pairs, cells);
            }
            sums::hand_over(self.totals, &totals);
        }
        self.end(&mut run);
    }
}

/// Sums in single precision over blocks that follow each other in a cell.
struct Run {
    cell: u16,
    lanes: [[f32; BLOCK]; SUMS],
    /// What each node adds; filled anew each time.
    each: [[f32; LANES]; SUMS],
}

impl Part<'_, '_> {
    #[inline(always)]
    fn add(&mut self, run: &mut Run, totals: &mut [[f32; BLOCK]; sums::SUMS], pairs: &Pairs, cells: &[[u16; BLOCK]]) {
        let along_target = derivatives(&pairs.lever, &pairs.normal);
        let along_source = derivatives(&pairs.lever, &pairs.source_normal);
        sums::add(totals, pairs, &along_target);
        let lanes = &mut run.each;
        let (mut score, mut half_slope) = ([0.0_f32; LANES], [0.0_f32; LANES]);
        for l in 0..LANES {
            score[l] = pairs.weight[l] * pairs.residual[l];
            half_slope[l] = 0.5 * pairs.slope[l];
        }
        let mut k = 0;
        for r in 0..6 {
            for l in 0..LANES {
                lanes[r][l] = along_target[r][l] * score[l];
            }
            for c in r..6 {
                for l in 0..LANES {
                    let cross = along_target[r][l] * along_source[c][l] + along_target[c][l] * along_source[r][l];
                    lanes[6 + k][l] = half_slope[l] * cross;
                }
                k += 1;
            }
        }
        let mut at = 0;
        while at < cells.len() {
            let same = cells[at..].iter().take_while(|cell_of| cell_of.iter().all(|cell| *cell == run.cell)).count();
            // Blocks that follow each other in one cell are summed up in the registers.
            for (sum, lane) in run.lanes.iter_mut().zip(&run.each) {
                let mut own = *sum;
                for block in &lane.as_chunks::<BLOCK>().0[at..at + same] {
                    for l in 0..BLOCK {
                        own[l] += block[l];
                    }
                }
                *sum = own;
            }
            at += same;
            if at < cells.len() {
                self.sort(run, at * BLOCK, &cells[at], &pairs.weight);
                at += 1;
            }
        }
    }

    /// Adds the lanes of a block that lies in several cells or begins another one, from `first` on, each to its cell.
    #[inline(always)]
    fn sort(&mut self, run: &mut Run, first: usize, cell_of: &[u16; BLOCK], weight: &[f32; LANES]) {
        let mut waiting = [false; BLOCK];
        for l in 0..BLOCK {
            waiting[l] = weight[first + l] > 0.0;
        }
        while let Some(next) = waiting.iter().position(|w| *w) {
            let cell = cell_of[next];
            if cell != run.cell {
                self.end(run);
                run.cell = cell;
            }
            let mut share = [0.0; BLOCK];
            for l in 0..BLOCK {
                share[l] = if cell_of[l] == cell { 1.0 } else { 0.0 };
                waiting[l] &= cell_of[l] != cell;
            }
            for (sum, lane) in run.lanes.iter_mut().zip(&run.each) {
                for l in 0..BLOCK {
                    sum[l] += share[l] * lane[first + l];
                }
            }
        }
    }

    /// Hands the sums of a run over to its cell.
    #[inline(always)]
    fn end(&mut self, run: &mut Run) {
        sums::hand_over(&mut self.cells[usize::from(run.cell)], &run.lanes);
        run.lanes = [[0.0; BLOCK]; SUMS];
    }
}
