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

impl pulp::WithSimd for NodeRow<'_> {
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

impl NodeRow<'_> {
    /// `BIN`: pixels a side of a node, 0 where only known when running.
    #[inline(always)]
    fn run<const BIN: usize>(mut self) -> bool {
        if !self.is_whole {
            self.share.fill(1.0);
            self.place.fill([0.0; 2]);
            self.is_whole = true;
        }
        let whole = self.grid.cols / BLOCK * BLOCK;
        for first in (0..whole).step_by(BLOCK) {
            self.block::<BIN, BLOCK>(first);
        }
        for first in whole..self.grid.cols {
            self.block::<BIN, 1>(first);
        }
        self.is_whole
    }

    #[inline(always)]
    fn block<const BIN: usize, const N: usize>(&mut self, first: usize) {
        let bin = if BIN == 0 { self.grid.bin } else { BIN };
        let (mut sum, mut sigma) = ([0.0_f32; N], [0.0_f32; N]);
        // Invalid pixels are seldom alone.
        if !self.is_whole {
            let valid = self.valid::<BIN, N>(first, &mut sum, &mut sigma);
            self.average(first, &valid, &sum, &sigma);
            return;
        }
        let mut least = [f32::INFINITY; N];
        for line in 0..bin {
            let start = self.pixels(first, line);
            let points = &self.points[start..start + N * bin];
            // All nodes side by side, so that the divisions are.
            for pixel in 0..bin {
                for k in 0..N {
                    sum[k] += inverse(points[k * bin + pixel][2]);
                }
            }
            if let Some(values) = self.sigma {
                let values = &values[start..start + N * bin];
                for pixel in 0..bin {
                    for k in 0..N {
                        let v = values[pixel * N + k];
                        least[k] = if v < least[k] { v } else { least[k] };
                    }
                }
                for (s, v) in sigma.iter_mut().zip(values.chunks_exact(bin)) {
                    *s += v.iter().sum::<f32>();
                }
            }
        }
        let mut is_whole = true;
        for k in 0..N {
            is_whole &= (sum[k] + sigma[k]).is_finite() & (least[k] > 0.0);
        }
        if is_whole {
            self.average(first, &[(bin * bin) as f32; N], &sum, &sigma);
        } else {
            self.is_whole = false;
            let valid = self.valid::<BIN, N>(first, &mut sum, &mut sigma);
            self.average(first, &valid, &sum, &sigma);
        }
    }

    /// Nodes from the numbers of their pixels and the sums over them.
    #[inline(always)]
    fn average<const N: usize>(&mut self, first: usize, valid: &[f32; N], sum: &[f32; N], sigma: &[f32; N]) {
        let side = self.grid.bin as f32;
        let cosine = &self.grid.cosine[self.row * self.grid.cols + first..][..N];
        let (inverse_depth, spread) = (&mut self.inverse_depth[first..][..N], &mut self.spread[first..][..N]);
        for k in 0..N {
            let (n, w) = (valid[k], sum[k] / valid[k]);
            // The average of n independent errors has the n-th part of their variance; depth is range times cosine.
            let s = sigma[k] / n / n.sqrt() * cosine[k] * w * w;
            let s = if self.sigma.is_some() { s } else { side / n.sqrt() };
            inverse_depth[k] = if s > 0.0 && s < f32::INFINITY { w } else { f32::NAN };
            spread[k] = s;
        }
    }

    /// The sums over the valid pixels alone, and how many they are.
    #[inline(always)]
    fn valid<const BIN: usize, const N: usize>(
        &mut self,
        first: usize,
        sum: &mut [f32; N],
        sigma: &mut [f32; N],
    ) -> [f32; N] {
        let bin = if BIN == 0 { self.grid.bin } else { BIN };
        let nothing = [0.0_f32; N];
        let (mut valid, mut across, mut down) = (nothing, nothing, nothing);
        (*sum, *sigma) = (nothing, nothing);
        let middle = (bin as f32 - 1.0) / 2.0;
        for line in 0..bin {
            let start = self.pixels(first, line);
            let points = &self.points[start..start + N * bin];
            for pixel in 0..bin {
                let mut known = nothing;
                if let Some(values) = self.sigma {
                    let values = &values[start..start + N * bin];
                    for k in 0..N {
                        known[k] = usable(values[k * bin + pixel]);
                    }
                }
                for k in 0..N {
                    let w = inverse(points[k * bin + pixel][2]);
                    let is_valid = (w + known[k]).is_finite();
                    let one = if is_valid { 1.0 } else { 0.0 };
                    valid[k] += one;
                    across[k] += one * (pixel as f32 - middle);
                    down[k] += one * (line as f32 - middle);
                    sum[k] += if is_valid { w } else { 0.0 };
                    sigma[k] += if is_valid { known[k] } else { 0.0 };
                }
            }
        }
        let (share, place) = (&mut self.share[first..][..N], &mut self.place[first..][..N]);
        for k in 0..N {
            let per_node = if valid[k] > 0.0 { 1.0 / (valid[k] * bin as f32) } else { 0.0 };
            share[k] = valid[k] / (bin * bin) as f32;
            place[k] = [across[k] * per_node, down[k] * per_node];
        }
        valid
    }

    /// Index of the first pixel of a line of a node.
    #[inline(always)]
    fn pixels(&self, node: usize, line: usize) -> usize {
        let bin = self.grid.bin;
        (self.row * bin + line) * self.width + node * bin
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

/// A standard deviation, NaN where it is none.
#[inline(always)]
fn usable(sigma: f32) -> f32 {
    if (sigma > 0.0) & (sigma < f32::INFINITY) { sigma } else { f32::NAN }
}
