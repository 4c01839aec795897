//! Which links can be in the minimum spanning tree, told from the four edges of a pixel and of a square of pixels.
//!
//! The cheapest link of a pixel is in the tree (cut property); the dearest of the four links around a square of pixels
//! is not (cycle property). Both are found without a branch, for many pixels at once, and leave about a third of a link
//! a pixel to think about.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// No short cuts: comparing is cheaper than a branch, and only without branches go many pixels at once.
#![allow(clippy::needless_bitwise_bool)]

use range_image::with_wide_registers;

use crate::tree::grid::{DOWN, Grid, RIGHT};
use crate::tree::seams::Seam;

/// A pixel without any link.
pub(crate) const ALONE: u8 = 0;
pub(crate) const UP: u8 = 1;
pub(crate) const LEFT: u8 = 2;
pub(crate) const TO_RIGHT: u8 = 3;
pub(crate) const TO_BELOW: u8 = 4;
/// A pixel that takes no part.
pub(crate) const OUTSIDE: u8 = 5;

/// Costs of the links of one padded row, to the right and down; infinite where there is no link.
#[derive(Debug, Default)]
struct LinkCosts {
    right: Vec<f32>,
    down: Vec<f32>,
}

/// The cheapest link of every pixel, and the links that remain.
#[derive(Debug, Default)]
pub(crate) struct Candidates {
    /// Cheapest link of each padded pixel.
    pub choice: Vec<u8>,
    /// Links, bits `RIGHT` and `DOWN`, that are nobody's cheapest and not the dearest of a square.
    pub open: Vec<u8>,
    rows: [LinkCosts; 3],
}

impl LinkCosts {
    /// Where `links` are given, those without their bit are closed.
    #[inline(always)]
    fn measure(&mut self, here: &[f32], below: &[f32], links: Option<&[u8]>) {
        let n = here.len();
        self.right.resize(n, f32::INFINITY);
        self.down.resize(n, f32::INFINITY);
        for (out, (here, right)) in self.right.iter_mut().zip(here.iter().zip(&here[1..])) {
            *out = here + right;
        }
        for (out, (here, below)) in self.down.iter_mut().zip(here.iter().zip(below)) {
            *out = here + below;
        }
        let Some(links) = links else { return };
        for ((right, down), link) in self.right.iter_mut().zip(&mut self.down).zip(links) {
            *right = if link & RIGHT == 0 { f32::INFINITY } else { *right };
            *down = if link & DOWN == 0 { f32::INFINITY } else { *down };
        }
    }
}

impl Candidates {
    /// The cheapest link of each pixel, ties to the lower edge index (edges count in scan order, right before down).
    pub fn choose(&mut self, grid: &Grid, cost: &[f32], links: Option<&[u8]>) {
        self.choice.clear();
        self.choice.resize(grid.len(), OUTSIDE);
        with_wide_registers(
            #[inline(always)]
            || self.choose_rows(grid, cost, links),
        );
    }

    #[inline(always)]
    fn choose_rows(&mut self, grid: &Grid, cost: &[f32], links: Option<&[u8]>) {
        let Self { choice, rows: [above, here, _], .. } = self;
        measure_row(above, grid, cost, links, 0);
        for row in 1..=grid.height {
            measure_row(here, grid, cost, links, row);
            let start = row * grid.stride + 1;
            let inside = start..start + grid.width;
            choose_row(&above.down[1..], &here.right, &here.down[1..], &cost[inside.clone()], &mut choice[inside]);
            std::mem::swap(above, here);
        }
    }

    /// Withdraws the choices of pixels that a seam joins more cheaply than their cheapest link: these wait for the rounds
    /// over the list of edges.
    pub fn withdraw(&mut self, grid: &Grid, cost: &[f32], seams: &[Seam]) {
        let ahead = [0, grid.stride.wrapping_neg(), usize::MAX, 1, grid.stride, 0, 0, 0];
        for seam in seams {
            let ends = [seam.from as usize, seam.to as usize];
            let joined = ends.iter().map(|&end| cost[end]).sum::<f32>() + seam.surcharge;
            for end in ends {
                let choice = self.choice[end];
                if (UP..=TO_BELOW).contains(&choice) {
                    let chosen = cost[end] + cost[end.wrapping_add(ahead[usize::from(choice)])];
                    self.choice[end] = if joined < chosen { ALONE } else { choice };
                }
            }
        }
    }

    /// Opens the links that the choices and squares leave. Choices may have been withdrawn (set to `ALONE`) before.
    pub fn open(&mut self, grid: &Grid, cost: &[f32], links: Option<&[u8]>) {
        self.open.clear();
        self.open.resize(grid.len(), 0);
        with_wide_registers(
            #[inline(always)]
            || self.open_rows(grid, cost, links),
        );
    }

    #[inline(always)]
    fn open_rows(&mut self, grid: &Grid, cost: &[f32], links: Option<&[u8]>) {
        let Self { choice, open, rows: [above, here, below] } = self;
        measure_row(above, grid, cost, links, 0);
        measure_row(here, grid, cost, links, 1);
        for row in 1..=grid.height {
            measure_row(below, grid, cost, links, row + 1);
            let start = row * grid.stride + 1;
            let out = &mut open[start..start + grid.width];
            open_row(above, here, below, out);
            close_chosen(&choice[start..], &choice[start + grid.stride..], out);
            std::mem::swap(above, here);
            std::mem::swap(here, below);
        }
    }
}

/// Costs of the links of a padded row; the last row has none below.
#[inline(always)]
fn measure_row(out: &mut LinkCosts, grid: &Grid, cost: &[f32], links: Option<&[u8]>, row: usize) {
    let padded = |row: usize| row * grid.stride..(row + 1) * grid.stride;
    let below = &cost[padded((row + 1).min(grid.height + 1))];
    out.measure(&cost[padded(row)], below, links.map(|links| &links[padded(row)]));
}

#[inline(always)]
fn choose_row(up: &[f32], sideways: &[f32], down: &[f32], cost: &[f32], out: &mut [u8]) {
    let n = out.len();
    let (up, left, right, down) = (&up[..n], &sideways[..n], &sideways[1..][..n], &down[..n]);
    let cost = &cost[..n];
    for col in 0..n {
        // `<` keeps the first of equals; that order is the one of edge indices.
        let mut best = f32::INFINITY;
        let mut choice = u32::from(if cost[col] < f32::INFINITY { ALONE } else { OUTSIDE });
        for (cost, direction) in [(up[col], UP), (left[col], LEFT), (right[col], TO_RIGHT), (down[col], TO_BELOW)] {
            choice = if cost < best { u32::from(direction) } else { choice };
            best = if cost < best { cost } else { best };
        }
        out[col] = choice as u8;
    }
}

/// A link is the dearest of a square if no other of its four costs more, or as much at a higher index.
#[inline(always)]
fn open_row(above: &LinkCosts, here: &LinkCosts, below: &LinkCosts, out: &mut [u8]) {
    let n = out.len();
    let (right, down) = (&here.right[1..][..n], &here.down[1..][..n]);
    let (left, left_down, right_down) = (&here.right[..n], &here.down[..n], &here.down[2..][..n]);
    let (up_right, up_down, up_right_down) = (&above.right[1..][..n], &above.down[1..][..n], &above.down[2..][..n]);
    let (below_right, below_left) = (&below.right[1..][..n], &below.right[..n]);
    for col in 0..n {
        let (across, along) = (right[col], down[col]);
        let top = (across > along) & (across > right_down[col]) & (across > below_right[col]);
        let bottom = (across >= up_right[col]) & (across >= up_down[col]) & (across >= up_right_down[col]);
        let west = (along >= across) & (along > right_down[col]) & (along > below_right[col]);
        let east = (along >= left[col]) & (along >= left_down[col]) & (along > below_left[col]);
        let keep_across = !(top | bottom) & (across < f32::INFINITY);
        let keep_along = !(west | east) & (along < f32::INFINITY);
        out[col] = u8::from(keep_across) * RIGHT + u8::from(keep_along) * DOWN;
    }
}

/// Links that an end has chosen are joined already.
#[inline(always)]
fn close_chosen(choice: &[u8], below: &[u8], out: &mut [u8]) {
    let n = out.len();
    let (choice, next, below) = (&choice[..n], &choice[1..][..n], &below[..n]);
    for col in 0..n {
        let across = (choice[col] == TO_RIGHT) | (next[col] == LEFT);
        let along = (choice[col] == TO_BELOW) | (below[col] == UP);
        out[col] &= !(u8::from(across) * RIGHT + u8::from(along) * DOWN);
    }
}
