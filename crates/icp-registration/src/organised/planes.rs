//! Planes through the nodes of a frame.
//!
//! A plane is `a u + b v + c = 1/depth`; a and b come from a square window of nodes, c from the node alone: a wider
//! window would round off creases, and the error of the offset is what reaches the pose.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// Lanes lie side by side: with an index, loops read as their formulas and have the same length everywhere.
#![allow(clippy::needless_range_loop)]

use super::grid::Grid;

/// Nodes taken at a time.
const BLOCK: usize = 16;
/// Half width of the window, nodes.
const HALF: usize = 1;
/// Nodes of the window beyond the three that any plane goes through.
pub(super) const FREEDOM: f32 = ((2 * HALF + 1) * (2 * HALF + 1) - 3) as f32;

/// One row of planes.
pub(super) struct PlaneRow<'a> {
    pub grid: &'a Grid,
    pub row: usize,
    /// Inverse depth of all nodes.
    pub inverse_depth: &'a [f32],
    /// Standard deviations of all nodes.
    pub spread: &'a [f32],
    /// Unit normal, leading away from the camera, and distance of the plane from the perspective centre; NaN: none.
    pub planes: &'a mut [[f32; 4]],
    /// Standard deviation of the distance, metre (per unit of spread where that has none).
    pub sigma: &'a mut [f32],
    /// Mean square deviation of the window from the plane, in units of the spread.
    pub misfit: &'a mut [f32],
}

impl pulp::WithSimd for PlaneRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        self.run();
    }
}

impl PlaneRow<'_> {
    #[inline(always)]
    fn run(mut self) {
        self.planes.fill([f32::NAN; 4]);
        self.misfit.fill(f32::NAN);
        let cols = self.grid.cols;
        if self.row < HALF || self.row + HALF >= self.grid.rows || cols < 2 * HALF + 1 {
            return;
        }
        let last = cols - HALF;
        let whole = (last - HALF) / BLOCK * BLOCK + HALF;
        for first in (HALF..whole).step_by(BLOCK) {
            self.block::<BLOCK>(first);
        }
        for first in whole..last {
            self.block::<1>(first);
        }
    }

    #[inline(always)]
    fn block<const N: usize>(&mut self, first: usize) {
        let cols = self.grid.cols;
        let start = self.row * cols + first;
        let mut centre = [0.0_f32; N];
        centre.copy_from_slice(&self.inverse_depth[start..start + N]);
        // Sums of the differences from the centre: the values themselves would cancel.
        let (mut sum, mut square, mut by_col, mut by_row) = ([0.0_f32; N], [0.0_f32; N], [0.0_f32; N], [0.0_f32; N]);
        for j in 0..=2 * HALF {
            let y = j as f32 - HALF as f32;
            for i in 0..=2 * HALF {
                let x = i as f32 - HALF as f32;
                let from = start + j * cols + i - HALF * cols - HALF;
                let values = &self.inverse_depth[from..from + N];
                for k in 0..N {
                    let e = values[k] - centre[k];
                    sum[k] += e;
                    square[k] += e * e;
                    by_col[k] += x * e;
                    by_row[k] += y * e;
                }
            }
        }
        let count = (2 * HALF + 1).pow(2) as f32;
        let moment = count * (HALF * (HALF + 1)) as f32 / 3.0;
        let grid = self.grid;
        let (u, v) = (&grid.u[start..start + N], &grid.v[start..start + N]);
        let (gradient, spread) = (&grid.gradient[start..start + N], &self.spread[start..start + N]);
        let (planes, sigma) = (&mut self.planes[first..first + N], &mut self.sigma[first..first + N]);
        let misfit = &mut self.misfit[first..first + N];
        for k in 0..N {
            let (gc, gr) = (by_col[k] / moment, by_row[k] / moment);
            let rest = square[k] - sum[k] * sum[k] / count - (gc * gc + gr * gr) * moment;
            misfit[k] = rest / (FREEDOM * spread[k] * spread[k]);
            let m = gradient[k];
            let (a, b) = (m[0] * gc + m[1] * gr, m[2] * gc + m[3] * gr);
            let c = centre[k] - a * u[k] - b * v[k];
            // a x + b y - c z = 1 on the plane.
            let distance = 1.0 / (a * a + b * b + c * c).sqrt();
            planes[k] = [a * distance, b * distance, -c * distance, distance];
            sigma[k] = distance / centre[k] * spread[k];
        }
    }
}
