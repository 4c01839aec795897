//! Minimum spanning forest of the pixel grid by contraction `[Boruvka1926]`.
//!
//! Every pixel picks its cheapest link, and the picked links join pixels to components. Of the other links those that
//! no tree can hold are dropped, and the rest goes, as a list of edges, into further rounds. No global sort, no random
//! walks over the image: the components are numbered in scan order, so neighbours in the image stay neighbours in
//! memory.

use crate::tree::candidates::{Candidates, LEFT, OUTSIDE, TO_BELOW, TO_RIGHT, UP};
use crate::tree::contraction::{Contraction, Edge, Member};
use crate::tree::grid::{Grid, set_bits, wrap_step};
use crate::tree::seams::Seam;

/// Label of a pixel that belongs to no component.
pub(crate) const NO_LABEL: u32 = u32::MAX;

/// A spanning forest: component and relative wrap count of every pixel. Buffers are kept for the next image.
#[derive(Debug, Default)]
pub(crate) struct Forest {
    /// Component of each padded pixel, numbered in scan order of their first pixel.
    pub label: Vec<u32>,
    /// Wrap count of each padded pixel relative to its component.
    pub wraps: Vec<i32>,
    /// Number of components.
    pub components: usize,
    candidates: Candidates,
    contraction: Contraction,
    /// First pixel of each run of pixels that hang together by links up and to the left.
    first: Vec<u32>,
    number: Vec<u32>,
}

impl Forest {
    /// Grows the forest over the linked neighbours, all neighbours where no `links` are given; an edge costs the sum of
    /// its pixels' costs, ties go to the lower edge index. Pixels of infinite cost stay out. `seams` are further links.
    pub fn grow(&mut self, grid: &Grid, phase: &[f32], cost: &[f32], links: Option<&[u8]>, seams: &[Seam]) {
        self.candidates.choose(grid, cost, links);
        self.candidates.withdraw(grid, cost, seams);
        self.candidates.open(grid, cost, links);
        self.join_runs(grid, phase);
        self.hang_runs(grid, phase);
        let components = self.collect_edges(grid, phase, cost, seams);
        self.components = self.contraction.run(components);
        self.resolve();
    }

    /// Bytes held by the buffers.
    pub fn bytes(&self) -> usize {
        let words = [self.label.capacity(), self.wraps.capacity(), self.first.capacity(), self.number.capacity()];
        let candidates = self.candidates.choice.capacity() + self.candidates.open.capacity();
        4 * words.iter().sum::<usize>() + candidates + self.contraction.bytes()
    }

    /// Pixels that picked the one above or to the left take its label; all others begin a run of their own.
    fn join_runs(&mut self, grid: &Grid, phase: &[f32]) {
        self.label.clear();
        self.label.resize(grid.len(), NO_LABEL);
        self.wraps.clear();
        self.wraps.resize(grid.len(), 0);
        self.first.clear();
        let mut runs = 0;
        for start in grid.row_starts() {
            self.first.resize(runs + grid.width, 0);
            runs += self.join_row(grid, phase, start, runs);
        }
        self.first.truncate(runs);
    }

    /// No branch: which way a pixel hangs is a coin toss that no processor predicts.
    fn join_row(&mut self, grid: &Grid, phase: &[f32], start: usize, before: usize) -> usize {
        let n = grid.width;
        let (above, here) = self.label.split_at_mut(start);
        let (up_label, label) = (&above[start - grid.stride..][..n], &mut here[..n]);
        let (above, here) = self.wraps.split_at_mut(start);
        let (up_wraps, wraps) = (&above[start - grid.stride..][..n], &mut here[..n]);
        let choice = &self.candidates.choice[start..][..n];
        let (up, left, centre) = (&phase[start - grid.stride..][..n], &phase[start - 1..][..n], &phase[start..][..n]);
        let first = &mut self.first[before..][..n];
        let (mut runs, mut left_label, mut left_wraps) = (0, NO_LABEL, 0);
        for col in 0..n {
            let hangs_up = choice[col] == UP;
            let (parent, label_of, wraps_of) =
                if hangs_up { (up[col], up_label[col], up_wraps[col]) } else { (left[col], left_label, left_wraps) };
            let hangs = hangs_up || choice[col] == LEFT;
            let outside = choice[col] == OUTSIDE;
            first[runs.min(n - 1)] = (start + col) as u32;
            let own = if outside { NO_LABEL } else { (before + runs) as u32 };
            left_label = if hangs { label_of } else { own };
            left_wraps = if hangs { wraps_of + wrap_step(parent, centre[col]) } else { 0 };
            label[col] = left_label;
            wraps[col] = left_wraps;
            runs += usize::from(!(hangs || outside));
        }
        runs
    }

    /// Each run hangs on the run that the choice of its first pixel leads to; of two pixels that chose each other the
    /// later is in the run of the earlier, so that this run hangs on itself.
    fn hang_runs(&mut self, grid: &Grid, phase: &[f32]) {
        let mut ahead = [0; 8];
        ahead[usize::from(TO_RIGHT)] = 1;
        ahead[usize::from(TO_BELOW)] = grid.stride;
        let level = self.contraction.first_level();
        level.reserve_exact(self.first.len());
        for (run, &first) in self.first.iter().enumerate() {
            let first = first as usize;
            let target = first + ahead[usize::from(self.candidates.choice[first] & 7)];
            let root = self.label[target];
            let offset = self.wraps[target] + wrap_step(phase[target], phase[first]);
            level.push(Member { root, offset: if root as usize == run { 0 } else { offset } });
        }
    }

    /// The open links between different components, in scan order.
    fn collect_edges(&mut self, grid: &Grid, phase: &[f32], cost: &[f32], seams: &[Seam]) -> usize {
        let (label, wraps) = (&self.label, &self.wraps);
        let (components, edges, level) = self.contraction.join_first();
        let place = |pixel: usize| {
            let member = level[label[pixel] as usize];
            (member.root, wraps[pixel] + member.offset)
        };
        let edge = |pixel: usize, other: usize, surcharge: f32| {
            let ((from, here), (to, there)) = (place(pixel), place(other));
            let step = wrap_step(phase[pixel], phase[other]) + here - there;
            (from != to).then_some(Edge { from, to, cost: cost[pixel] + cost[other] + surcharge, step })
        };
        edges.clear();
        for start in grid.row_starts() {
            for (block, open) in self.candidates.open[start..start + grid.width].chunks(8).enumerate() {
                for bit in set_bits(open) {
                    let pixel = start + 8 * block + bit / 8;
                    let ahead = if bit.is_multiple_of(8) { 1 } else { grid.stride };
                    edges.extend(edge(pixel, pixel + ahead, 0.0));
                }
            }
        }
        for seam in seams {
            let (from, to) = (seam.from as usize, seam.to as usize);
            if cost[from] < f32::INFINITY && cost[to] < f32::INFINITY {
                edges.extend(edge(from, to, seam.surcharge));
            }
        }
        components
    }

    /// Carries roots and offsets back to the pixels.
    fn resolve(&mut self) {
        let members = self.contraction.resolve();
        // Runs are in scan order; the number of a component is to be that of its first.
        self.number.clear();
        self.number.resize(self.components, NO_LABEL);
        let mut next = 0;
        for member in members.iter_mut() {
            let number = &mut self.number[member.root as usize];
            if *number == NO_LABEL {
                *number = next;
                next += 1;
            }
            member.root = *number;
        }
        for (label, wraps) in self.label.iter_mut().zip(&mut self.wraps) {
            if let Some(member) = members.get(*label as usize) {
                *wraps += member.offset;
                *label = member.root;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::grid::{DOWN, RIGHT};

    fn bytes<T>(buffer: &Vec<T>) -> usize {
        buffer.capacity() * size_of::<T>()
    }

    /// All that the tree needs, phase, cost and links included, stays below 40 bytes a pixel.
    #[test]
    fn memory_is_bounded() -> crate::Result<()> {
        let grid = Grid::new(300, 200)?;
        // A hash of the index as noise: the worst case for the number of edges that remain.
        let noise = |index: usize| (index as u32).wrapping_mul(2_654_435_761) as f32 / u32::MAX as f32;
        let inside = |index: usize| (1..=grid.width).contains(&(index % grid.stride)) && grid.inner().contains(&index);
        let phase: Vec<f32> = (0..grid.len()).map(|i| if inside(i) { 6.2 * noise(i) } else { f32::NAN }).collect();
        let cost: Vec<f32> = phase.iter().map(|p| if p.is_nan() { f32::INFINITY } else { *p }).collect();
        let open = |i: usize, other: usize| other < grid.len() && inside(i) && inside(other);
        let links: Vec<u8> = (0..grid.len())
            .map(|i| if open(i, i + 1) { RIGHT } else { 0 } | if open(i, i + grid.stride) { DOWN } else { 0 })
            .collect();
        let mut forest = Forest::default();
        forest.grow(&grid, &phase, &cost, Some(&links), &[]);
        assert_eq!(forest.components, 1);
        let total = forest.bytes() + bytes(&phase) + bytes(&cost) + bytes(&links);
        assert!(total <= 40 * 300 * 200, "{} bytes a pixel", total as f64 / 60_000.0);
        Ok(())
    }
}
