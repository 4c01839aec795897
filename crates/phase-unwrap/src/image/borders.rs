//! Borders between segments: how well a wrap difference would make the surface continuous across them.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// No short cuts, so that many pixels go at once.
#![allow(clippy::needless_bitwise_bool)]

use range_image::with_wide_registers;

use crate::image::surface::{Step, Surface};
use crate::tree::forest::{Forest, NO_LABEL};
use crate::tree::grid::{DOWN, Grid, RIGHT, set_bits, wrap_step};
use crate::tree::seams::Seam;

/// Evidence, in nats, for `offset(to) - offset(from) == step`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tie {
    pub from: u32,
    pub to: u32,
    pub step: i32,
    pub bonus: f32,
}

/// One crossing of a border by a pixel edge.
#[derive(Debug, Clone, Copy)]
struct Crossing {
    from: u32,
    to: u32,
    step: i32,
    evidence: f32,
}

/// All borders of an image.
#[derive(Debug, Default)]
pub(crate) struct Borders {
    pub ties: Vec<Tie>,
    /// Label of the island of each segment, from 0.
    pub island: Vec<u32>,
    /// Number of islands.
    pub islands: usize,
    crossings: Vec<Crossing>,
    flags: Vec<u8>,
}

impl Borders {
    pub fn collect(&mut self, grid: &Grid, surface: &Surface, forest: &Forest, seams: &[Seam]) {
        self.crossings.clear();
        for start in grid.row_starts() {
            flag_row(grid, forest, start, &mut self.flags);
            for (block, flags) in self.flags.chunks(8).enumerate() {
                for bit in set_bits(flags) {
                    let pixel = start + 8 * block + bit / 8;
                    let ahead = if bit.is_multiple_of(8) { 1 } else { grid.stride };
                    self.crossings.push(crossing(surface, forest, [pixel, pixel + ahead], ahead));
                }
            }
        }
        for seam in seams {
            let ends = [seam.from as usize, seam.to as usize];
            let [from, to] = ends.map(|pixel| forest.label[pixel]);
            if from != to && from != NO_LABEL && to != NO_LABEL {
                self.crossings.push(crossing(surface, forest, ends, seam.ahead(grid)));
            }
        }
        self.crossings.sort_by_key(|c| (c.from, c.to, c.step));
        self.ties.clear();
        for border in self.crossings.chunk_by(|a, b| (a.from, a.to) == (b.from, b.to)) {
            let length = border.len();
            for side in border.chunk_by(|a, b| a.step == b.step) {
                self.ties.extend(tie(side, length));
            }
        }
        self.find_islands(forest.components);
    }

    /// Segments that touch are one island, whatever lies between them.
    fn find_islands(&mut self, segments: usize) {
        let mut parent: Vec<u32> = (0..segments as u32).collect();
        for crossing in &self.crossings {
            let (a, b) = (root(&mut parent, crossing.from), root(&mut parent, crossing.to));
            // The lower label wins, so islands are numbered in scan order.
            parent[a.max(b) as usize] = a.min(b);
        }
        self.islands = 0;
        self.island.clear();
        for segment in 0..segments as u32 {
            let first = root(&mut parent, segment);
            let label = if first == segment {
                self.islands += 1;
                self.islands as u32 - 1
            } else {
                self.island[first as usize]
            };
            self.island.push(label);
        }
    }
}

fn root(parent: &mut [u32], mut node: u32) -> u32 {
    while parent[node as usize] != node {
        parent[node as usize] = parent[parent[node as usize] as usize];
        node = parent[node as usize];
    }
    node
}

/// Flags the links of a row, `RIGHT` and `DOWN`, whose ends lie in two segments.
fn flag_row(grid: &Grid, forest: &Forest, start: usize, flags: &mut Vec<u8>) {
    let n = grid.width;
    let (here, right) = (&forest.label[start..][..n], &forest.label[start + 1..][..n]);
    let down = &forest.label[start + grid.stride..][..n];
    flags.resize(n, 0);
    let flags = &mut flags[..n];
    with_wide_registers(
        #[inline(always)]
        || {
            for col in 0..n {
                let crosses = |other: u32| (other != here[col]) & (other != NO_LABEL) & (here[col] != NO_LABEL);
                flags[col] = u8::from(crosses(right[col])) * RIGHT + u8::from(crosses(down[col])) * DOWN;
            }
        },
    );
}

fn crossing(surface: &Surface, forest: &Forest, [pixel, other]: [usize; 2], ahead: usize) -> Crossing {
    let step = wrap_step(surface.phase[pixel], surface.phase[other]) + forest.wraps[pixel] - forest.wraps[other];
    let evidence = continuity(surface.step(pixel, other, ahead), surface.sigma(pixel, other));
    directed(forest.label[pixel], forest.label[other], step, evidence)
}

fn directed(from: u32, to: u32, step: i32, evidence: f32) -> Crossing {
    if from < to {
        Crossing { from, to, step, evidence }
    } else {
        Crossing { from: to, to: from, step: -step, evidence }
    }
}

/// Logarithm of the likelihood ratio of "one surface" to "a jump" for one pixel edge.
///
/// Phase: two-sided exponential against uniform on (-pi, pi). Logarithm of the amplitude ratio: two-sided exponential
/// of scale 0.5 (texture) against one of scale 2 (another object at another range).
fn continuity(step: Step, sigma: f32) -> f32 {
    let scale = 0.15_f32.max(1.5 * sigma);
    let phase = (std::f32::consts::PI / scale).ln() - step.phase / scale;
    let amplitude = if step.amplitude.is_nan() { 0.0 } else { 4.0_f32.ln() - 1.5 * step.amplitude };
    phase.max(-2.0) + amplitude.max(-4.0)
}

/// What the crossings that agree on one step say together, given the length of the whole border.
///
/// Crossings of one border are no independent witnesses: the mean counts, not the sum; short borders count less,
/// long ones a little more.
fn tie(side: &[Crossing], length: usize) -> Option<Tie> {
    let first = side.first()?;
    let count = side.len() as f32;
    let mean = side.iter().map(|c| c.evidence).sum::<f32>() / count;
    let weight = (count / 6.0).tanh() * (1.0 + 0.5 * (1.0 + count / 20.0).ln());
    let bonus = mean * weight * count / length as f32;
    (bonus > 0.0).then_some(Tie { from: first.from, to: first.to, step: first.step, bonus })
}
