//! From pixels to nodes: averages of inverse depth over squares of pixels.
//!
//! On a plane, inverse depth is linear in x/depth and y/depth, so the average over a square of pixels belongs to the
//! average of their rays, whatever the plane's tilt.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// Without branches, all lanes are compared at once.
#![allow(clippy::needless_bitwise_bool)]
// Lanes lie side by side: with an index, loops read as their formulas and have the same length everywhere.
#![allow(clippy::needless_range_loop)]

use super::grid::Grid;

/// Nodes taken at a time.
const BLOCK: usize = 32;
/// Depths that count as measured, metre.
pub(super) const LEAST_DEPTH_M: f64 = 1e-5;
pub(super) const LARGEST_DEPTH_M: f64 = 1e7;

/// One row of nodes from the pixels below it.
pub(super) struct NodeRow<'a> {
    pub grid: &'a Grid,
    pub row: usize,
    /// Pixels in a row.
    pub width: usize,
    pub points: &'a [[f64; 3]],
    pub sigma: Option<&'a [f32]>,
    /// Inverse depth of the nodes, per metre; NaN where a pixel has none.
    pub inverse_depth: &'a mut [f32],
    /// Standard deviation of the inverse depth; 1 where no sigma is given.
    pub spread: &'a mut [f32],
}

impl pulp::WithSimd for NodeRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        match self.grid.bin {
            1 => self.run::<1>(),
            2 => self.run::<2>(),
            3 => self.run::<3>(),
            4 => self.run::<4>(),
            _ => self.run::<0>(),
        }
    }
}

impl NodeRow<'_> {
    /// `BIN`: pixels a side of a node, 0 where only known when running.
    #[inline(always)]
    fn run<const BIN: usize>(mut self) {
        let whole = self.grid.cols / BLOCK * BLOCK;
        for first in (0..whole).step_by(BLOCK) {
            self.block::<BIN, BLOCK>(first);
        }
        for first in whole..self.grid.cols {
            self.block::<BIN, 1>(first);
        }
    }

    #[inline(always)]
    fn block<const BIN: usize, const N: usize>(&mut self, first: usize) {
        let bin = if BIN == 0 { self.grid.bin } else { BIN };
        let mut sum = [0.0_f32; N];
        let mut sigma = [0.0_f32; N];
        for line in 0..bin {
            let start = (self.row * bin + line) * self.width + first * bin;
            let points = &self.points[start..start + N * bin];
            // All nodes side by side, so that the divisions are.
            for pixel in 0..bin {
                for k in 0..N {
                    sum[k] += inverse(points[k * bin + pixel][2]);
                }
            }
            if let Some(values) = self.sigma {
                for (s, v) in sigma.iter_mut().zip(values[start..start + N * bin].chunks_exact(bin)) {
                    *s += v.iter().sum::<f32>();
                }
            }
        }
        let count = (bin * bin) as f32;
        let cosine = &self.grid.cosine[self.row * self.grid.cols + first..][..N];
        let (inverse_depth, spread) = (&mut self.inverse_depth[first..][..N], &mut self.spread[first..][..N]);
        for k in 0..N {
            let w = sum[k] / count;
            // The average of n independent errors has the n-th part of their variance; depth is range times cosine.
            let s = sigma[k] / count / bin as f32 * cosine[k] * w * w;
            let known = s > 0.0 && s < f32::INFINITY || self.sigma.is_none();
            inverse_depth[k] = if known { w } else { f32::NAN };
            spread[k] = if self.sigma.is_none() { 1.0 } else { s };
        }
    }
}

/// Inverse depth of a point, NaN where it has none.
#[inline(always)]
fn inverse(z: f64) -> f32 {
    // What single precision cannot hold is infinite, and fails.
    let depth = -z as f32;
    let known = (depth > LEAST_DEPTH_M as f32) & (depth < LARGEST_DEPTH_M as f32);
    1.0 / if known { depth } else { f32::NAN }
}
