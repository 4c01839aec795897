//! The nodes of a source frame in the order and arrangement in which they are worked on.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// Lanes lie side by side: with an index, loops read as their formulas and have the same length everywhere.
#![allow(clippy::needless_range_loop)]

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::preparation::grid::{BLOCK, Grid, NO_NODE, STRIDES};

/// Blocks that one thread takes at least.
const BLOCKS_PER_TASK: usize = 256;

/// Some nodes side by side; NaN where there is no plane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Block {
    pub position: [[f32; BLOCK]; 3],
    pub normal: [[f32; BLOCK]; 3],
    /// Variance of the position along the normal, m².
    pub variance: [f32; BLOCK],
    pub node: [u32; BLOCK],
}

/// The nodes level by level, coarse ones first.
#[derive(Debug, Clone)]
pub(crate) struct Points {
    pub blocks: Vec<Block>,
    /// Nodes with a plane among those of each level.
    pub counts: [usize; STRIDES.len()],
    /// Centroid and rms radius of the first level that has nodes with planes.
    pub centre: Vector3<f64>,
    pub radius_m: f64,
}

impl Points {
    pub(crate) fn new(grid: &Grid) -> Self {
        let (blocks, counts) = (Vec::new(), [0; STRIDES.len()]);
        let mut points = Self { blocks, counts, centre: Vector3::zeros(), radius_m: 0.0 };
        points.arrange(grid);
        points
    }

    /// Makes the blocks those of another grid.
    pub(crate) fn arrange(&mut self, grid: &Grid) {
        let nothing = [f32::NAN; BLOCK];
        let empty = |node: &[u32; BLOCK]| Block {
            position: [nothing; 3],
            normal: [nothing; 3],
            variance: nothing,
            node: *node,
        };
        self.blocks.clear();
        self.blocks.extend(grid.order.iter().map(empty));
    }

    /// Takes over the nodes of a frame.
    pub(crate) fn gather(&mut self, grid: &Grid, inverse_depth: &[f32], planes: &[[f32; 4]], sigma: &[f32]) {
        let parts = self.blocks.par_chunks_mut(BLOCKS_PER_TASK).enumerate();
        let counts = parts.fold_with([0; STRIDES.len()], |mut counts, (part, blocks)| {
            let first = part * BLOCKS_PER_TASK;
            let counts_of = &mut counts;
            let gather = Gather { grid, inverse_depth, planes, sigma, first, blocks, counts: counts_of };
            pulp::Arch::new().dispatch(gather);
            counts
        });
        self.counts = counts.reduce_with(|a, b| std::array::from_fn(|level| a[level] + b[level])).unwrap_or_default();
        for level in 1..STRIDES.len() {
            self.counts[level] += self.counts[level - 1];
        }
        self.measure(grid);
    }

    /// Numbers and measures alone.
    pub(crate) fn without_blocks(&self) -> Self {
        Self { blocks: Vec::new(), counts: self.counts, centre: self.centre, radius_m: self.radius_m }
    }

    fn measure(&mut self, grid: &Grid) {
        let level = self.counts.iter().position(|c| *c > 0).unwrap_or(0);
        let count = self.counts[level].max(1) as f64;
        let mean = self.nodes(grid.levels[level]).fold(Vector3::zeros(), |sum, p| sum + p) / count;
        let square = self.nodes(grid.levels[level]).fold(0.0, |sum, p| sum + (p - mean).norm_squared());
        self.centre = mean;
        self.radius_m = (square / count).sqrt();
    }

    /// Positions of the nodes with a plane in the first blocks.
    fn nodes(&self, blocks: usize) -> impl Iterator<Item = Vector3<f64>> + '_ {
        let all =
            self.blocks[..blocks].iter().flat_map(|b| (0..BLOCK).map(move |k| [0, 1, 2].map(|i| b.position[i][k])));
        all.filter(|p| p[2].is_finite()).map(|p| Vector3::from(p.map(f64::from)))
    }
}

/// Fills blocks that follow each other.
struct Gather<'a> {
    grid: &'a Grid,
    inverse_depth: &'a [f32],
    planes: &'a [[f32; 4]],
    sigma: &'a [f32],
    /// Index of the first of the blocks.
    first: usize,
    blocks: &'a mut [Block],
    /// Nodes with a plane that each level adds.
    counts: &'a mut [usize; STRIDES.len()],
}

impl pulp::WithSimd for Gather<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { grid, inverse_depth, planes, sigma, first, blocks, counts } = self;
        let mut level = 0;
        for (index, block) in blocks.iter_mut().enumerate() {
            while first + index >= grid.levels[level] {
                level += 1;
            }
            let nothing = [f32::NAN; BLOCK];
            let (mut plane, mut u, mut v, mut w, mut s) = ([[f32::NAN; 4]; BLOCK], nothing, nothing, nothing, nothing);
            for k in 0..BLOCK {
                if block.node[k] != NO_NODE {
                    let node = block.node[k] as usize;
                    (plane[k], u[k], v[k]) = (planes[node], grid.u[node], grid.v[node]);
                    (w[k], s[k]) = (inverse_depth[node], sigma[node]);
                }
            }
            let mut count = 0_u32;
            for k in 0..BLOCK {
                let depth = if plane[k][3].is_finite() { 1.0 / w[k] } else { f32::NAN };
                block.position[0][k] = u[k] * depth;
                block.position[1][k] = v[k] * depth;
                block.position[2][k] = -depth;
                block.variance[k] = s[k] * s[k];
                count += u32::from(depth.is_finite());
            }
            for i in 0..3 {
                for k in 0..BLOCK {
                    block.normal[i][k] = plane[k][i];
                }
            }
            counts[level] += count as usize;
        }
    }
}
