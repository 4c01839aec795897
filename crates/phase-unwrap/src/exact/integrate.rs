//! Wrap counts from steps whose loops all close.

use super::ExactUnwrapped;
use super::network::Network;
use crate::tree::grid::{Grid, wrap_step};

/// Padded planes of the result.
#[derive(Debug, Default)]
pub(super) struct Integration {
    wraps: Vec<i32>,
    island: Vec<u32>,
    queue: Vec<u32>,
}

impl Integration {
    /// Walks through each island; any way gives the same counts.
    pub fn run(&mut self, grid: &Grid, phase: &[f32], network: &Network, out: &mut ExactUnwrapped) {
        self.wraps.clear();
        self.wraps.resize(grid.len(), 0);
        self.island.clear();
        self.island.resize(grid.len(), 0);
        let mut islands = 0;
        for first in grid.inner() {
            if phase[first].is_nan() || self.island[first] != 0 {
                continue;
            }
            islands += 1;
            self.walk(grid, phase, network, first, islands);
            let lowest = self.queue.iter().map(|&pixel| self.wraps[pixel as usize]).min().unwrap_or(0);
            for &pixel in &self.queue {
                self.wraps[pixel as usize] -= lowest;
            }
        }
        out.islands = islands as usize;
        grid.crop(&self.wraps, &mut out.wraps, |&wraps| wraps);
        grid.crop(&self.island, &mut out.island, |&island| island);
    }

    /// Counts of the island of a pixel; its pixels are left in the queue.
    fn walk(&mut self, grid: &Grid, phase: &[f32], network: &Network, first: usize, island: u32) {
        self.queue.clear();
        self.queue.push(first as u32);
        self.island[first] = island;
        let mut next = 0;
        while let Some(&pixel) = self.queue.get(next) {
            next += 1;
            let pixel = pixel as usize;
            let stride = grid.stride;
            let ways = [
                (0, pixel, pixel + 1),
                (1, pixel, pixel + stride),
                (0, pixel - 1, pixel - 1),
                (1, pixel - stride, pixel - stride),
            ];
            for (axis, edge, other) in ways {
                if network.price[axis][edge] > 0 && self.island[other] == 0 {
                    let sign = if edge == pixel { 1 } else { -1 };
                    let step = wrap_step(phase[pixel], phase[other]) + sign * network.added[axis][edge];
                    self.island[other] = island;
                    self.wraps[other] = self.wraps[pixel] + step;
                    self.queue.push(other as u32);
                }
            }
        }
    }
}
