//! Loops that masked pixels join: the outside of the image, and holes in it.

use super::network::Network;
use crate::tree::grid::Grid;

/// Region of a loop of four used pixels.
pub(super) const NONE: u32 = 0;
/// Region of the image's border and of the holes that reach it.
pub(super) const OUTSIDE: u32 = 1;

/// Region of each loop, and the loops of each hole.
#[derive(Debug, Default)]
pub(super) struct Regions {
    /// `NONE`, `OUTSIDE`, or 2 and more for holes.
    pub region: Vec<u32>,
    members: Vec<u32>,
    /// End of each region's members.
    ends: Vec<usize>,
    stack: Vec<usize>,
}

impl Regions {
    /// Loops on either side of a step that is masked away belong together.
    pub fn find(&mut self, grid: &Grid, network: &Network) {
        self.region.clear();
        self.region.resize(grid.len(), NONE);
        self.members.clear();
        self.ends.clear();
        self.ends.push(0);
        for row in 0..=grid.height {
            for col in 0..=grid.width {
                let first = row * grid.stride + col;
                if self.region[first] == NONE && masked_steps(grid, network, first).iter().any(|masked| *masked) {
                    self.flood(grid, network, first);
                }
            }
        }
    }

    fn flood(&mut self, grid: &Grid, network: &Network, first: usize) {
        // The first loop of the padded grid lies outside the image, so the outside is found first.
        let label = self.ends.len() as u32;
        self.region[first] = label;
        self.stack.push(first);
        while let Some(f) = self.stack.pop() {
            self.members.push(f as u32);
            let (row, col) = (f / grid.stride, f % grid.stride);
            let inside = [row > 0, row < grid.height, col > 0, col < grid.width];
            let neighbours = [f.wrapping_sub(grid.stride), f + grid.stride, f.wrapping_sub(1), f + 1];
            let masked = masked_steps(grid, network, f);
            for side in 0..4 {
                let other = neighbours[side];
                if inside[side] && masked[side] && self.region[other] == NONE {
                    self.region[other] = label;
                    self.stack.push(other);
                }
            }
        }
        self.ends.push(self.members.len());
    }

    pub fn members(&self, region: u32) -> &[u32] {
        let region = region as usize;
        &self.members[self.ends[region - 1]..self.ends[region]]
    }

    /// The loop that stands for all of its region.
    pub fn representative(&self, f: usize) -> usize {
        match self.region[f] {
            NONE => f,
            region => self.members(region)[0] as usize,
        }
    }

    /// Number of regions, the outside included.
    pub fn len(&self) -> usize {
        self.ends.len() - 1
    }
}

/// Whether the steps above, below, left and right of a loop are masked away.
fn masked_steps(grid: &Grid, network: &Network, f: usize) -> [bool; 4] {
    let [right, down] = &network.price;
    [right[f] == 0, right[f + grid.stride] == 0, down[f] == 0, down[f + 1] == 0]
}
