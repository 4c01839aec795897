//! Planes through the nodes of a frame.
//!
//! A plane is `a u + b v + c = 1/depth`; a and b come from a square window of nodes, c from the node alone: a wider
//! window would round off creases, and the error of the offset is what reaches the pose. Nodes count as many times as
//! they have valid pixels, each at their mean place. A node without any, but surrounded by others, has c from the window.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// Lanes lie side by side: with an index, loops read as their formulas and have the same length everywhere.
#![allow(clippy::needless_range_loop)]

use crate::preparation::grid::Grid;

/// Nodes taken at a time.
const BLOCK: usize = 16;
/// Half width of the window, nodes.
pub(crate) const HALF: usize = 1;
/// Nodes of the window, those of them beyond the three that any plane goes through, and their scatter along an axis.
const NODES: f32 = ((2 * HALF + 1) * (2 * HALF + 1)) as f32;
pub(crate) const FREEDOM: f32 = NODES - 3.0;
pub(crate) const MOMENT: f32 = NODES * (HALF * (HALF + 1)) as f32 / 3.0;

/// How much more variance the plane may have in the middle of its window than that of a whole one. One-sided windows,
/// at the rim of what was seen, are told by it: there the surface ends, and so do its errors.
const LARGEST_VARIANCE: f32 = 2.0;

/// What rounding leaves: of inverse depth, relative, and of the squares in a window by the places of its pixels.
pub(crate) const ROUNDING: f32 = 1e-6;

/// One row of planes.
pub(crate) struct PlaneRow<'a> {
    pub grid: &'a Grid,
    pub row: usize,
    /// Inverse depth of all nodes.
    pub inverse_depth: &'a [f32],
    /// Standard deviations of all nodes.
    pub spread: &'a [f32],
    /// Whether all pixels of the frame are valid, their shares of all nodes, and their mean places.
    pub is_whole: bool,
    pub share: &'a [f32],
    pub place: &'a [[f32; 2]],
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
        // The last block overlaps the one before: nodes one by one cost as much as blocks.
        for first in (HALF..last).step_by(BLOCK) {
            if last < BLOCK + HALF {
                (first..last).for_each(|node| self.block::<1>(node));
            } else {
                self.block::<BLOCK>(first.min(last - BLOCK));
            }
        }
    }

    #[inline(always)]
    fn block<const N: usize>(&mut self, first: usize) {
        let start = self.row * self.grid.cols + first;
        let (mut is_whole, mut is_empty) = (true, !self.is_whole);
        for row in 0..if self.is_whole { 0 } else { 2 * HALF + 1 } {
            let shares = &self.share[start + row * self.grid.cols - HALF * self.grid.cols - HALF..][..N + 2 * HALF];
            for k in 0..N + 2 * HALF {
                is_whole &= shares[k] >= 1.0;
                is_empty &= shares[k] <= 0.0;
            }
        }
        if is_whole {
            self.fit::<N, true>(first);
        } else if is_empty {
            // Planes are none already.
            self.sigma[first..first + N].fill(f32::NAN);
        } else {
            self.fit::<N, false>(first);
        }
    }

    /// `WHOLE`: all pixels of all windows are valid.
    #[inline(always)]
    fn fit<const N: usize, const WHOLE: bool>(&mut self, first: usize) {
        let cols = self.grid.cols;
        let start = self.row * cols + first;
        // Values of the nodes, and variances of whole ones.
        let (mut centre, mut variance) = ([f32::NAN; N], [f32::NAN; N]);
        // A node without pixels refers to one beside it.
        for at in &[start, start - 1, start + 1, start - cols, start + cols][..if WHOLE { 1 } else { 5 }] {
            let [values, spreads, shares] =
                [self.inverse_depth, self.spread, self.share].map(|list| &list[*at..*at + N]);
            for k in 0..N {
                let v = if WHOLE { spreads[k] * spreads[k] } else { spreads[k] * spreads[k] * shares[k] };
                variance[k] = if centre[k].is_nan() { v } else { variance[k] };
                centre[k] = if centre[k].is_nan() { values[k] } else { centre[k] };
            }
        }
        // Sums of the differences from the centre: the values themselves would cancel.
        let mut sums = [[0.0_f32; N]; SUMS];
        for j in 0..=2 * HALF {
            for i in 0..=2 * HALF {
                let from = start + j * cols + i - HALF * cols - HALF;
                let (values, shares, places) =
                    (&self.inverse_depth[from..from + N], &self.share[from..from + N], &self.place[from..from + N]);
                let (x, y) = (i as f32 - HALF as f32, j as f32 - HALF as f32);
                for k in 0..N {
                    let e = values[k] - centre[k];
                    if WHOLE {
                        sums[0][k] += e;
                        sums[1][k] += e * e;
                        sums[2][k] += x * e;
                        sums[3][k] += y * e;
                        continue;
                    }
                    let (x, y, n) = (x + places[k][0], y + places[k][1], shares[k]);
                    // There is no value without pixels. One by one: a tuple is stored under a mask and waits for it.
                    let e = if n > 0.0 { e } else { 0.0 };
                    let one = if n > 0.0 { 1.0 } else { 0.0 };
                    let ne = n * e;
                    sums[0][k] += ne;
                    sums[1][k] += ne * e;
                    sums[2][k] += x * ne;
                    sums[3][k] += y * ne;
                    sums[4][k] += n * x;
                    sums[5][k] += n * y;
                    sums[6][k] += n * x * x;
                    sums[7][k] += n * x * y;
                    sums[8][k] += n * y * y;
                    sums[9][k] += n;
                    sums[10][k] += one;
                }
            }
        }
        self.solve::<N, WHOLE>(first, &centre, &variance, &sums);
    }

    #[inline(always)]
    fn solve<const N: usize, const WHOLE: bool>(
        &mut self,
        first: usize,
        centre: &[f32; N],
        variance: &[f32; N],
        sums: &[[f32; N]; SUMS],
    ) {
        let (grid, start) = (self.grid, self.row * self.grid.cols + first);
        let (u, v) = (&grid.u[start..start + N], &grid.v[start..start + N]);
        let (gradient, spread) = (&grid.gradient[start..start + N], &self.spread[start..start + N]);
        let (shares, places) = (&self.share[start..start + N], &self.place[start..start + N]);
        let (planes, sigma) = (&mut self.planes[first..first + N], &mut self.sigma[first..first + N]);
        let misfit = &mut self.misfit[first..first + N];
        for k in 0..N {
            let [.., x, y, xx, xy, yy, count, nodes] = sums;
            let window =
                if WHOLE { Window::WHOLE } else { Window::new([x[k], y[k], xx[k], xy[k], yy[k], count[k], nodes[k]]) };
            let (mut by_col, mut by_row) = (sums[2][k], sums[3][k]);
            if !WHOLE {
                by_col -= window.mean[0] * sums[0][k];
                by_row -= window.mean[1] * sums[0][k];
            }
            let (mut gc, mut gr) = (by_col / MOMENT, by_row / MOMENT);
            let mut explained = (gc * gc + gr * gr) * MOMENT;
            if !WHOLE {
                let [xx, xy, yy] = window.inverse;
                (gc, gr) = (xx * by_col + xy * by_row, xy * by_col + yy * by_row);
                explained = gc * by_col + gr * by_row + ROUNDING * sums[1][k];
            }
            let rest = sums[1][k] - sums[0][k] * sums[0][k] / window.count - explained;
            misfit[k] = rest / (window.freedom * variance[k]);
            let (mut w, mut s) = (centre[k], spread[k]);
            if !WHOLE {
                // The node's average, moved along the plane from the place of its pixels to its middle.
                let ([x, y], mean) = (places[k], window.mean);
                let more = 1.0 + shares[k] * window.product([x, y], [2.0 * mean[0] - x, 2.0 * mean[1] - y]);
                // Without pixels, the plane's own value. As its neighbours have the same errors, it counts as one of them.
                let alone = sums[0][k] / window.count - gc * mean[0] - gr * mean[1];
                let is_seen = shares[k] > 0.0;
                w += if is_seen { -gc * x - gr * y } else { alone };
                s = if is_seen { s * more.sqrt() } else { variance[k].sqrt() };
            }
            let m = gradient[k];
            let (a, b) = (m[0] * gc + m[1] * gr, m[2] * gc + m[3] * gr);
            let c = w - a * u[k] - b * v[k];
            // a x + b y - c z = 1 on the plane.
            let distance = 1.0 / (a * a + b * b + c * c).sqrt();
            planes[k] = [a * distance, b * distance, -c * distance, distance];
            sigma[k] = distance / w * s;
        }
    }
}

/// Sums over a window: 4 with the differences of inverse depth, 7 of the nodes' shares alone.
const SUMS: usize = 4 + 7;

/// How the valid pixels lie in a window.
#[derive(Clone, Copy)]
struct Window {
    /// In nodes.
    count: f32,
    /// Nodes beyond those that any plane goes through; NaN where no plane is known well enough.
    freedom: f32,
    mean: [f32; 2],
    /// Inverse scatter of the places: `xx, xy, yy`.
    inverse: [f32; 3],
}

impl Window {
    const WHOLE: Self =
        Self { count: NODES, freedom: FREEDOM, mean: [0.0; 2], inverse: [1.0 / MOMENT, 0.0, 1.0 / MOMENT] };

    /// From the sums over `x, y, xx, xy, yy, 1` of the shares, and the number of nodes.
    #[inline(always)]
    fn new([x, y, xx, xy, yy, count, nodes]: [f32; 7]) -> Self {
        let mean = [x / count, y / count];
        let (xx, xy, yy) = (xx - x * mean[0], xy - x * mean[1], yy - y * mean[1]);
        let determinant = xx * yy - xy * xy;
        let inverse = [yy / determinant, -xy / determinant, xx / determinant];
        let mut window = Self { count, freedom: nodes - 3.0, mean, inverse };
        let variance = NODES * (1.0 / count + window.product(mean, mean));
        // NaN fails.
        window.freedom = if variance <= LARGEST_VARIANCE { window.freedom } else { f32::NAN };
        window
    }

    /// `a' S⁻¹ b` with the scatter S of the places.
    #[inline(always)]
    fn product(&self, a: [f32; 2], b: [f32; 2]) -> f32 {
        let [xx, xy, yy] = self.inverse;
        xx * a[0] * b[0] + xy * (a[0] * b[1] + a[1] * b[0]) + yy * a[1] * b[1]
    }
}
