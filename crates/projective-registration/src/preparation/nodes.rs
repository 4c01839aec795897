//! From pixels to nodes: averages of inverse depth over the valid pixels of squares.
//!
//! On a plane, inverse depth is linear in x/depth and y/depth, so the average over some pixels belongs to the average of
//! their rays, whatever the plane's tilt.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// Without branches, all lanes are compared at once.
#![allow(clippy::needless_bitwise_bool)]
// Lanes lie side by side: with an index, loops read as their formulas and have the same length everywhere.
#![allow(clippy::needless_range_loop)]

use crate::preparation::grid::Grid;

/// Columns of pixels taken at a time, at least those of one node.
const PIXELS: usize = 96;
/// Depths that count as measured, metre.
pub(crate) const LEAST_DEPTH_M: f64 = 1e-5;
pub(crate) const LARGEST_DEPTH_M: f64 = 1e7;

/// One row of nodes from the pixels below it.
pub(crate) struct NodeRow<'a, T> {
    pub grid: &'a Grid,
    pub row: usize,
    /// Pixels in a row.
    pub width: usize,
    pub points: &'a [[T; 3]],
    pub sigma: Option<&'a [f32]>,
    /// Inverse depth of the nodes, per metre; NaN where no pixel has any.
    pub inverse_depth: &'a mut [f32],
    /// Standard deviation of the inverse depth; 1 for a whole square where no sigma is given.
    pub spread: &'a mut [f32],
    /// Share of the square's pixels that are valid.
    pub share: &'a mut [f32],
    /// Their mean place from the centre of the square along columns and rows, in nodes.
    pub place: &'a mut [[f32; 2]],
    /// Whether all pixels are valid; before, whether they were when the lists were last filled.
    pub is_whole: bool,
}

impl<T: Copy + Into<f64>> pulp::WithSimd for NodeRow<'_, T> {
    /// Whether all pixels are valid.
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> bool {
        match self.grid.bin {
            1 => self.run::<1>(),
            2 => self.run::<2>(),
            3 => self.run::<3>(),
            4 => self.run::<4>(),
            _ => self.run::<0>(),
        }
    }
}

impl<T: Copy + Into<f64>> NodeRow<'_, T> {
    /// `BIN`: pixels a side of a node, 0 where only known when running.
    #[inline(always)]
    fn run<const BIN: usize>(mut self) -> bool {
        let (cols, was_whole) = (self.grid.cols, self.is_whole);
        let most = PIXELS / self.grid.bin;
        self.is_whole = true;
        for first in (0..cols).step_by(most) {
            self.block::<BIN>(first, most.min(cols - first), was_whole);
        }
        self.is_whole
    }

    #[inline(always)]
    fn block<const BIN: usize>(&mut self, first: usize, count: usize, was_whole: bool) {
        let bin = if BIN == 0 { self.grid.bin } else { BIN };
        let columns = self.columns::<BIN>(first, count * bin);
        let middle = (bin as f32 - 1.0) / 2.0;
        let mut nodes = [[0.0_f32; PIXELS]; 5];
        for k in 0..count {
            let mut sums = [0.0; 5];
            for pixel in 0..bin {
                let at = k * bin + pixel;
                let (valid, right) = (columns[2][at], pixel as f32 - middle);
                let terms = [columns[0][at], columns[1][at], valid, columns[3][at], valid * right];
                for i in 0..5 {
                    sums[i] += terms[i];
                }
            }
            for i in 0..5 {
                nodes[i][k] = sums[i];
            }
        }
        let [sum, sigma, valid, down, across] = nodes;
        let mut is_whole = true;
        for k in 0..count {
            is_whole &= valid[k] >= (bin * bin) as f32;
        }
        self.is_whole &= is_whole;
        if !(is_whole & was_whole) {
            let (share, place) = (&mut self.share[first..][..count], &mut self.place[first..][..count]);
            for k in 0..count {
                let per_node = if valid[k] > 0.0 { 1.0 / (valid[k] * bin as f32) } else { 0.0 };
                share[k] = valid[k] / (bin * bin) as f32;
                place[k] = [across[k] * per_node, down[k] * per_node];
            }
        }
        self.average(first, &valid[..count], &sum[..count], &sigma[..count]);
    }

    /// Nodes from the numbers of their pixels and the sums over them.
    #[inline(always)]
    fn average(&mut self, first: usize, valid: &[f32], sum: &[f32], sigma: &[f32]) {
        let (side, count) = (self.grid.bin as f32, valid.len());
        let cosine = &self.grid.cosine[self.row * self.grid.cols + first..][..count];
        let (inverse_depth, spread) = (&mut self.inverse_depth[first..][..count], &mut self.spread[first..][..count]);
        for k in 0..count {
            let (n, w) = (valid[k], sum[k] / valid[k]);
            // The average of n independent errors has the n-th part of their variance; depth is range times cosine.
            let s = sigma[k] / n / n.sqrt() * cosine[k] * w * w;
            let s = if self.sigma.is_some() { s } else { side / n.sqrt() };
            inverse_depth[k] = if s > 0.0 && s < f32::INFINITY { w } else { f32::NAN };
            spread[k] = s;
        }
    }

    /// Sums along the columns of pixels of some nodes, over the valid ones: of inverse depth, sigma, one, and the
    /// distance below the middle of the node. First along columns: there pixels lie side by side in memory.
    #[inline(always)]
    fn columns<const BIN: usize>(&self, first: usize, pixels: usize) -> [[f32; PIXELS]; 4] {
        let bin = if BIN == 0 { self.grid.bin } else { BIN };
        let mut sums = [[0.0_f32; PIXELS]; 4];
        let ones = [1.0_f32; PIXELS];
        // Apart from the comparisons, which would be done in double precision otherwise.
        let mut depths = [0.0_f32; PIXELS];
        for line in 0..bin {
            let start = (self.row * bin + line) * self.width + first * bin;
            let points = &self.points[start..start + pixels];
            let sigma = self.sigma.map_or(&ones[..pixels], |sigma| &sigma[start..start + pixels]);
            let below = line as f32 - (bin as f32 - 1.0) / 2.0;
            for k in 0..pixels {
                let z: f64 = points[k][2].into();
                depths[k] = -(z as f32);
            }
            for k in 0..pixels {
                // What single precision cannot hold is infinite, and fails, as NaN does.
                let (depth, s) = (depths[k], sigma[k]);
                let is_known = (depth > LEAST_DEPTH_M as f32) & (depth < LARGEST_DEPTH_M as f32);
                // Below infinity: compared with that itself, classes of numbers would be told apart by their bits.
                let is_valid = is_known & (s > 0.0) & (s <= f32::MAX);
                let one = if is_valid { 1.0 } else { 0.0 };
                let depth = if is_valid { depth } else { f32::INFINITY };
                let s = if is_valid { s } else { 0.0 };
                sums[0][k] += 1.0 / depth;
                sums[1][k] += s;
                sums[2][k] += one;
                sums[3][k] += one * below;
            }
        }
        sums
    }
}
