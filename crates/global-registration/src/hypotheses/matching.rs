//! Correspondences: descriptors that are most alike.
// Only what is inlined is compiled for wide registers.
// Lanes of several arrays run in step.
#![allow(clippy::inline_always, clippy::needless_range_loop)]

use rayon::prelude::*;

use crate::description::descriptors::DescriptorTable;
use crate::description::fpfh::LANES;

/// Rows that share the loaded columns.
const ROWS: usize = 4;
/// Rows of a task.
const ROWS_PER_TASK: usize = 512;

/// A pair of rows whose descriptors are alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Match {
    pub(crate) source: u32,
    pub(crate) target: u32,
    /// Product of the unit vectors: 1 where they are equal.
    pub(crate) likeness: f32,
}

/// Pairs of which one is the most alike to the other, in the order of the source, then those that only the target chose in
/// its order. Neighbours on one surface resemble each other, so that the second best tells nothing.
pub(crate) fn matches(source: &DescriptorTable, target: &DescriptorTable) -> Vec<Match> {
    let (forward, backward) = (best_of_each(source, target), best_of_each(target, source));
    let is_good = |(_, best): &(usize, &Best)| best.likeness > 0.0;
    let is_mutual =
        |(j, best): &(usize, &Best)| forward.get(best.index as usize).is_some_and(|f| f.index as usize == *j);
    let chosen = forward.iter().enumerate().filter(is_good);
    let chosen = chosen.map(|(i, best)| Match { source: i as u32, target: best.index, likeness: best.likeness });
    let only_back = backward.iter().enumerate().filter(is_good).filter(|found| !is_mutual(found));
    let only_back = only_back.map(|(j, best)| Match { source: best.index, target: j as u32, likeness: best.likeness });
    chosen.chain(only_back).collect()
}

#[derive(Debug, Clone, Copy)]
struct Best {
    likeness: f32,
    index: u32,
}

fn best_of_each(rows: &DescriptorTable, columns: &DescriptorTable) -> Vec<Best> {
    let width = rows.width();
    if rows.len() == 0 || columns.len() == 0 || columns.width() != width {
        return Vec::new();
    }
    let panels = panels(columns);
    let indices: Vec<usize> = (0..rows.len()).collect();
    let parts: Vec<Vec<Best>> = indices
        .par_chunks(ROWS_PER_TASK)
        .map(|chunk| pulp::Arch::new().dispatch(Search { rows, first: chunk[0], count: chunk.len(), panels: &panels }))
        .collect();
    parts.concat()
}

/// Columns regrouped: a panel holds the first values of its columns, then the second ones, and so on.
fn panels(columns: &DescriptorTable) -> Vec<[f32; LANES]> {
    let width = columns.width();
    let mut panels = vec![[0.0; LANES]; columns.len().div_ceil(LANES) * width];
    for j in 0..columns.len() {
        for (k, value) in columns.row(j).iter().enumerate() {
            panels[j / LANES * width + k][j % LANES] = *value;
        }
    }
    panels
}

struct Search<'a> {
    rows: &'a DescriptorTable,
    first: usize,
    count: usize,
    panels: &'a [[f32; LANES]],
}

impl pulp::NullaryFnOnce for Search<'_> {
    type Output = Vec<Best>;

    #[inline(always)]
    fn call(self) -> Vec<Best> {
        let mut found = Vec::with_capacity(self.count);
        for start in (0..self.count).step_by(ROWS) {
            let row = |r: usize| self.rows.row(self.first + (start + r).min(self.count - 1));
            let block = best_of_block([row(0), row(1), row(2), row(3)], self.panels);
            found.extend(block.iter().take(self.count - start));
        }
        found
    }
}

#[inline(always)]
fn best_of_block(rows: [&[f32]; ROWS], panels: &[[f32; LANES]]) -> [Best; ROWS] {
    let width = rows[0].len();
    let mut running = [Running::default(); ROWS];
    for (number, panel) in panels.chunks_exact(width).enumerate() {
        let [mut a, mut b, mut c, mut d] = [[0.0_f32; LANES]; ROWS];
        for (k, column) in panel.iter().enumerate() {
            add_multiple(&mut a, rows[0][k], column);
            add_multiple(&mut b, rows[1][k], column);
            add_multiple(&mut c, rows[2][k], column);
            add_multiple(&mut d, rows[3][k], column);
        }
        for (running, products) in running.iter_mut().zip([a, b, c, d]) {
            running.take(&products, number as u32);
        }
    }
    running.map(|r| over_lanes(&r.best, &r.place))
}

#[inline(always)]
fn add_multiple(sum: &mut [f32; LANES], factor: f32, column: &[f32; LANES]) {
    for lane in 0..LANES {
        sum[lane] += factor * column[lane];
    }
}

/// Best of the columns so far, lane by lane, and its panel.
#[derive(Clone, Copy)]
struct Running {
    best: [f32; LANES],
    place: [u32; LANES],
}

impl Default for Running {
    fn default() -> Self {
        Self { best: [f32::NEG_INFINITY; LANES], place: [0; LANES] }
    }
}

impl Running {
    #[inline(always)]
    fn take(&mut self, products: &[f32; LANES], number: u32) {
        for lane in 0..LANES {
            let (product, best) = (products[lane], self.best[lane]);
            let better = product > best;
            self.place[lane] = if better { number } else { self.place[lane] };
            self.best[lane] = if better { product } else { best };
        }
    }
}

/// The best lane, of equal ones that with the lowest index.
#[inline(always)]
fn over_lanes(best: &[f32; LANES], place: &[u32; LANES]) -> Best {
    let index = |lane: usize| place[lane] * LANES as u32 + lane as u32;
    let mut winner = 0;
    for lane in 1..LANES {
        let order = best[lane].total_cmp(&best[winner]).then(index(winner).cmp(&index(lane)));
        if order == std::cmp::Ordering::Greater {
            winner = lane;
        }
    }
    Best { likeness: best[winner], index: index(winner) }
}
