//! Minimum spanning forest of the pixel grid by contraction `[Boruvka1926]`.
//!
//! Every component picks its cheapest edge, the picked edges join components, and the graph of the joined components
//! takes the place of the grid. No global sort, no random walks over the image: the components are numbered in scan
//! order, so neighbours in the image stay neighbours in memory.

use crate::grid::{DOWN, Grid, RIGHT, wrap_step};

/// Label of a pixel that belongs to no component.
pub(crate) const NO_LABEL: u32 = u32::MAX;
const NO_EDGE: u32 = u32::MAX;

/// Edge between two components; `step` is the wrap offset of `to` minus that of `from`.
#[derive(Debug, Clone, Copy)]
struct Edge {
    from: u32,
    to: u32,
    cost: f32,
    step: i32,
}

/// What became of the components of one level: the component of the next level, and the wrap offset in it.
#[derive(Debug, Default)]
struct Level {
    root: Vec<u32>,
    offset: Vec<i32>,
}

/// A spanning forest: component and relative wrap count of every pixel. Buffers are kept for the next image.
#[derive(Debug, Default)]
pub(crate) struct Forest {
    /// Component of each padded pixel, numbered in scan order of their first pixel.
    pub label: Vec<u32>,
    /// Wrap count of each padded pixel relative to its component.
    pub wraps: Vec<i32>,
    /// Number of components.
    pub components: usize,
    choice: Vec<u8>,
    edges: Vec<Edge>,
    best: Vec<u32>,
    best_cost: Vec<f32>,
    levels: Vec<Level>,
    path: Vec<u32>,
}

impl Forest {
    /// Grows the forest over the linked neighbours; an edge costs the sum of its pixels' costs, ties go to the lower
    /// edge index. Pixels of infinite cost stay out; links must join pixels of finite cost only.
    pub fn grow(&mut self, grid: &Grid, phase: &[f32], cost: &[f32], links: &[u8]) {
        self.choose(grid, cost, links);
        let mut components = self.join_pixels(grid, phase, cost);
        self.collect_edges(grid, phase, cost, links);
        let mut depth = 0;
        while !self.edges.is_empty() {
            if self.levels.len() == depth {
                self.levels.push(Level::default());
            }
            self.pick_edges(components);
            components = self.join_components(depth, components);
            self.contract_edges(depth);
            depth += 1;
        }
        self.components = components;
        self.resolve(depth);
    }

    /// The cheapest link of each pixel: 0 none, else 1 + position in [up, left, right, down].
    fn choose(&mut self, grid: &Grid, cost: &[f32], links: &[u8]) {
        self.choice.clear();
        self.choice.resize(grid.len(), 0);
        let stride = grid.stride;
        for start in grid.row_starts() {
            let width = grid.width;
            let shifted = |plane: usize| plane..plane + width;
            let out = &mut self.choice[shifted(start)];
            let (up, down) = (&cost[shifted(start - stride)], &cost[shifted(start + stride)]);
            let (left, right) = (&cost[shifted(start - 1)], &cost[shifted(start + 1)]);
            let (up_link, left_link) = (&links[shifted(start - stride)], &links[shifted(start - 1)]);
            let link = &links[shifted(start)];
            for col in 0..width {
                // The order up, left, right, down is that of the edge indices, and `<` keeps the first of equals.
                let mut best = f32::INFINITY;
                let mut choice = 0;
                let mut offer = |open: bool, cost: f32, direction: u8| {
                    // No short cut: both tests are cheaper than a branch that is wrong half of the time.
                    let better = u8::from(open) & u8::from(cost < best) != 0;
                    best = if better { cost } else { best };
                    choice = if better { direction } else { choice };
                };
                offer(up_link[col] & DOWN != 0, up[col], 1);
                offer(left_link[col] & RIGHT != 0, left[col], 2);
                offer(link[col] & RIGHT != 0, right[col], 3);
                offer(link[col] & DOWN != 0, down[col], 4);
                out[col] = choice;
            }
        }
    }

    fn join_pixels(&mut self, grid: &Grid, phase: &[f32], cost: &[f32]) -> usize {
        self.label.clear();
        self.label.resize(grid.len(), NO_LABEL);
        self.wraps.clear();
        self.wraps.resize(grid.len(), 0);
        let stride = grid.stride;
        let choice = &self.choice;
        let target = |pixel: usize| match choice[pixel] {
            1 => pixel - stride,
            2 => pixel - 1,
            3 => pixel + 1,
            4 => pixel + stride,
            _ => pixel,
        };
        let mut components = 0;
        for first in grid.inner() {
            if cost[first] == f32::INFINITY || self.label[first] != NO_LABEL {
                continue;
            }
            let mut pixel = first;
            while self.label[pixel] == NO_LABEL {
                let next = target(pixel);
                // Two pixels that picked each other: the first of them is the root.
                if next == pixel || (target(next) == pixel && pixel < next) {
                    self.label[pixel] = components;
                    components += 1;
                    break;
                }
                self.path.push(pixel as u32);
                pixel = next;
            }
            while let Some(child) = self.path.pop() {
                let child = child as usize;
                self.label[child] = self.label[pixel];
                self.wraps[child] = self.wraps[pixel] + wrap_step(phase[pixel], phase[child]);
                pixel = child;
            }
        }
        components as usize
    }

    fn collect_edges(&mut self, grid: &Grid, phase: &[f32], cost: &[f32], links: &[u8]) {
        self.edges.clear();
        for pixel in grid.inner() {
            let link = links[pixel];
            for (bit, other) in [(RIGHT, pixel + 1), (DOWN, pixel + grid.stride)] {
                let (from, to) = (self.label[pixel], self.label[other]);
                if link & bit != 0 && from != to {
                    let step = wrap_step(phase[pixel], phase[other]) + self.wraps[pixel] - self.wraps[other];
                    self.edges.push(Edge { from, to, cost: cost[pixel] + cost[other], step });
                }
            }
        }
    }

    /// The cheapest edge of each component; among equals the first in the list, which keeps scan order.
    fn pick_edges(&mut self, components: usize) {
        self.best.clear();
        self.best.resize(components, NO_EDGE);
        self.best_cost.clear();
        self.best_cost.resize(components, f32::INFINITY);
        for (index, edge) in self.edges.iter().enumerate() {
            for end in [edge.from as usize, edge.to as usize] {
                if edge.cost < self.best_cost[end] {
                    self.best_cost[end] = edge.cost;
                    self.best[end] = index as u32;
                }
            }
        }
    }

    fn join_components(&mut self, depth: usize, components: usize) -> usize {
        let Level { root, offset } = &mut self.levels[depth];
        root.clear();
        root.resize(components, NO_LABEL);
        offset.clear();
        offset.resize(components, 0);
        let (best, edges) = (&self.best, &self.edges);
        let mut joined = 0;
        for first in 0..components as u32 {
            let mut node = first;
            while root[node as usize] == NO_LABEL {
                let next = best_target(best, edges, node);
                if next == node || (best[next as usize] == best[node as usize] && node < next) {
                    root[node as usize] = joined;
                    joined += 1;
                    break;
                }
                self.path.push(node);
                node = next;
            }
            while let Some(child) = self.path.pop() {
                let edge = &edges[best[child as usize] as usize];
                let step = if edge.to == child { edge.step } else { -edge.step };
                root[child as usize] = root[node as usize];
                offset[child as usize] = offset[node as usize] + step;
                node = child;
            }
        }
        joined as usize
    }

    fn contract_edges(&mut self, depth: usize) {
        let Level { root, offset } = &self.levels[depth];
        self.edges.retain_mut(|edge| {
            let (from, to) = (edge.from as usize, edge.to as usize);
            edge.step += offset[from] - offset[to];
            edge.from = root[from];
            edge.to = root[to];
            edge.from != edge.to
        });
    }

    /// Carries roots and offsets of the last level back to the pixels.
    fn resolve(&mut self, depth: usize) {
        for level in (1..depth).rev() {
            let (lower, upper) = self.levels.split_at_mut(level);
            let (lower, upper) = (&mut lower[level - 1], &upper[0]);
            for (root, offset) in lower.root.iter_mut().zip(&mut lower.offset) {
                *offset += upper.offset[*root as usize];
                *root = upper.root[*root as usize];
            }
        }
        if depth == 0 {
            return;
        }
        let level = &self.levels[0];
        for (label, wraps) in self.label.iter_mut().zip(&mut self.wraps) {
            if *label != NO_LABEL {
                *wraps += level.offset[*label as usize];
                *label = level.root[*label as usize];
            }
        }
    }
}

fn best_target(best: &[u32], edges: &[Edge], node: u32) -> u32 {
    match best[node as usize] {
        NO_EDGE => node,
        index => {
            let edge = &edges[index as usize];
            if edge.from == node { edge.to } else { edge.from }
        }
    }
}
