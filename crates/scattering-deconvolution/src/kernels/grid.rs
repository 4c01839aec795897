//! The grid on which scattered light is computed: that of the pixels, or a wider one that carries smooth light as well.
//!
//! Between pixels and wide grid stand quadratic B-splines: their first two moments do not depend on where a pixel lies
//! between the nodes, so that passing through them widens a Gaussian by a known amount and does nothing else up to the
//! third order.

use std::f64::consts::TAU;

use fourier_transforms::num_complex::Complex;
use range_image::with_wide_registers;
use rayon::prelude::*;

use crate::kernels::lanes::{self, LANES};
use crate::kernels::spectrum::Spectrum;

/// Rows of pixels that one task takes at least; smaller tasks cost more to hand out than to do.
pub(crate) const ROWS_PER_TASK: usize = 16;

/// One image axis: its pixels and its nodes.
pub(crate) struct Axis {
    pub(super) pixels: usize,
    pub(super) nodes: usize,
    pub(super) spacing: usize,
    pub(super) taps: Vec<Taps>,
    /// Weights of the pixels of a cell in its three nodes; zero beyond the cell.
    lanes: [[f32; LANES]; 3],
}

/// The nodes that a pixel belongs to: the first of `Axis::tap_count` in a row, and the weight of each.
#[derive(Clone, Copy)]
pub(super) struct Taps {
    pub(super) first: usize,
    pub(super) weights: [f32; 3],
}

impl Axis {
    /// Nodes `spacing` pixels (at most [`LANES`]) apart, with one node more beyond each end; the pixels themselves for spacing 1.
    pub(crate) fn new(pixels: usize, spacing: usize) -> Self {
        let spacing = spacing.min(LANES);
        if spacing <= 1 {
            let taps = (0..pixels).map(|first| Taps { first, weights: [1.0, 0.0, 0.0] }).collect();
            return Self { pixels, nodes: pixels, spacing: 1, taps, lanes: [[0.0; LANES]; 3] };
        }
        let taps = (0..pixels).map(|pixel| {
            let (cell, within) = (pixel / spacing, pixel % spacing);
            let u = (within as f64 + 0.5) / spacing as f64 - 0.5;
            let weights = [0.5 * (0.5 - u).powi(2), 0.75 - u * u, 0.5 * (0.5 + u).powi(2)];
            Taps { first: cell, weights: weights.map(|weight| weight as f32) }
        });
        let taps: Vec<Taps> = taps.collect();
        let mut lanes = [[0.0; LANES]; 3];
        for (lane, taps) in taps.iter().take(spacing).enumerate() {
            lanes.iter_mut().zip(taps.weights).for_each(|(lanes, weight)| lanes[lane] = weight);
        }
        Self { pixels, nodes: pixels.div_ceil(spacing) + 2, spacing, taps, lanes }
    }

    pub(crate) fn spacing(&self) -> usize {
        self.spacing
    }

    /// Variance, in square pixels, that passing to the nodes and back adds to a kernel: a quarter of the square spacing
    /// each way.
    pub(crate) fn added_variance(&self) -> f64 {
        if self.spacing == 1 { 0.0 } else { self.spacing.pow(2) as f64 / 2.0 }
    }

    /// Position of a node in pixels.
    fn position(&self, node: usize) -> f64 {
        if self.spacing == 1 {
            return node as f64;
        }
        (node as f64 - 1.0) * self.spacing as f64 + (self.spacing as f64 - 1.0) / 2.0
    }

    /// Position of a node as a normalised coordinate, -1 and 1 at the ends of the image.
    pub(crate) fn normalised(&self, node: usize) -> f64 {
        let pixels = self.pixels as f64;
        (2.0 * self.position(node) + 1.0 - pixels) / pixels
    }

    /// Sum of the positions of a node and of that which takes its place in reverse order, in pixels.
    pub(crate) fn reversal_px(&self) -> f64 {
        self.position(0) + self.position(self.nodes - 1)
    }

    fn tap_count(&self) -> usize {
        if self.spacing == 1 { 1 } else { 3 }
    }

    /// What pixel `pixel` has to do with node `node`.
    fn weight(&self, pixel: usize, node: usize) -> Option<f32> {
        let taps = self.taps[pixel];
        (taps.first..taps.first + self.tap_count()).contains(&node).then(|| taps.weights[node - taps.first])
    }

    /// Length of a line of pixels that [`lanes::collect`] and [`lanes::spread`] can work on.
    pub(super) fn line_length(&self) -> usize {
        self.pixels.next_multiple_of(self.spacing) + LANES
    }

    /// Sums a row of pixels into its nodes.
    fn collect(&self, lines: [&[f32]; 2], nodes: &mut [Complex<f32>]) {
        if self.spacing == 1 {
            let pixels = lines[0].iter().zip(lines[1]);
            nodes.iter_mut().zip(pixels).for_each(|(node, (re, im))| *node = Complex::new(*re, *im));
        } else {
            with_wide_registers(
                #[inline(always)]
                || lanes::collect(lines, &self.lanes, self.spacing, nodes),
            );
        }
    }

    /// Interpolates a row of nodes at its pixels, times `factor`.
    pub(super) fn spread(&self, nodes: &[Complex<f32>], factor: f32, [re, im]: [&mut [f32]; 2]) {
        if self.spacing == 1 {
            let pixels = re.iter_mut().zip(im);
            nodes.iter().zip(pixels).for_each(|(node, (re, im))| (*re, *im) = (factor * node.re, factor * node.im));
        } else {
            with_wide_registers(
                #[inline(always)]
                || lanes::spread(nodes, factor, &self.lanes, self.spacing, [re, im]),
            );
        }
    }

    /// Pixels that belong to a node.
    fn pixels_of(&self, node: usize) -> std::ops::Range<usize> {
        let cells = (node + 1).saturating_sub(self.tap_count())..node + 1;
        (cells.start * self.spacing).min(self.pixels)..(cells.end * self.spacing).min(self.pixels)
    }

    /// Nodes to pixels and back to nodes: the five diagonals of a band matrix.
    fn round_trip(&self) -> [Vec<f32>; 5] {
        let entry = |row: usize, diagonal: usize| {
            let Some(column) = (row + diagonal).checked_sub(2) else { return 0.0 };
            let pixels = self.pixels_of(row);
            let products = pixels.filter_map(|p| Some(self.weight(p, row)? * self.weight(p, column)?));
            products.sum::<f32>() / self.spacing as f32
        };
        std::array::from_fn(|diagonal| (0..self.nodes).map(|row| entry(row, diagonal)).collect())
    }
}

/// Both axes, with the buffers between them.
pub(crate) struct Grid {
    pub(super) axes: [Axis; 2],
    bands: [[Vec<f32>; 5]; 2],
    /// Weights of the rows of a cell in its three rows of nodes, with the scale of both axes.
    row_weights: Vec<[f32; 3]>,
    /// Real and imaginary part of three sums over the rows of each cell.
    sums: [Vec<f32>; 2],
    /// Real and imaginary part with the pixels' columns and the nodes' rows, in lines that go on for some zeros.
    pub(super) halfway: [Vec<f32>; 2],
    spare: Vec<Complex<f32>>,
    /// A row of pixels.
    pub(super) row: Vec<f32>,
}

impl Grid {
    pub(crate) fn new(size: [usize; 2], spacing: [usize; 2]) -> Self {
        let axes = [0, 1].map(|axis| Axis::new(size[axis], spacing[axis]));
        let bands = [axes[0].round_trip(), axes[1].round_trip()];
        let scale = 1.0 / (axes[0].spacing * axes[1].spacing) as f32;
        let tap_rows = axes[1].taps.iter().take(axes[1].spacing);
        let row_weights = tap_rows.map(|taps| taps.weights.map(|weight| scale * weight)).collect();
        let cells = axes[1].pixels.div_ceil(axes[1].spacing);
        let sums = [(); 2].map(|()| vec![0.0; 3 * cells * axes[0].pixels]);
        let halfway = [(); 2].map(|()| vec![0.0; axes[0].line_length() * axes[1].nodes]);
        let spare = vec![Complex::new(0.0, 0.0); axes[0].nodes * axes[1].nodes];
        let row = vec![0.0; axes[0].pixels];
        Self { axes, bands, row_weights, sums, halfway, spare, row }
    }

    pub(crate) fn axes(&self) -> &[Axis; 2] {
        &self.axes
    }

    /// Columns of pixels.
    pub(crate) fn width(&self) -> usize {
        self.axes[0].pixels
    }

    /// Columns and rows of nodes.
    pub(crate) fn size(&self) -> [usize; 2] {
        [self.axes[0].nodes, self.axes[1].nodes]
    }

    /// Normalised coordinates of the pixels, row by row.
    pub(crate) fn pixel_places(&self) -> impl Iterator<Item = [f64; 2]> {
        let [columns, rows] = [0, 1].map(|axis| self.axes[axis].pixels);
        let place = |pixel: usize, pixels: usize| (2.0 * pixel as f64 + 1.0) / pixels as f64 - 1.0;
        (0..rows).flat_map(move |row| (0..columns).map(move |col| [place(col, columns), -place(row, rows)]))
    }

    pub(crate) fn is_fine(&self) -> bool {
        self.axes.iter().all(|axis| axis.spacing == 1)
    }

    /// Brings planes of pixels to the nodes: `nodes = transposed interpolation (pixels) / (spacing * spacing)`.
    pub(crate) fn restrict(&mut self, real: &[f32], imaginary: &[f32], nodes: &mut [Complex<f32>]) {
        if self.is_fine() {
            for (node, (re, im)) in nodes.iter_mut().zip(real.iter().zip(imaginary)) {
                *node = Complex::new(*re, *im);
            }
            return;
        }
        let [across, down] = &self.axes;
        let (width, line) = (across.pixels, across.line_length());
        for (plane, sums) in [real, imaginary].into_iter().zip(&mut self.sums) {
            let cells = sums.par_chunks_mut(3 * width).zip(plane.par_chunks(down.spacing * width));
            let weights = &self.row_weights;
            let cells = cells.with_min_len(ROWS_PER_TASK.div_ceil(down.spacing));
            cells.for_each(|(sums, rows)| {
                with_wide_registers(
                    #[inline(always)]
                    || lanes::sum_rows(rows, weights, width, sums),
                );
            });
        }
        let [sums_re, sums_im] = &self.sums;
        let [re, im] = &mut self.halfway;
        let lines = re.par_chunks_mut(line).zip(im.par_chunks_mut(line));
        let rows = nodes.par_chunks_mut(across.nodes).zip(lines).with_min_len(ROWS_PER_TASK).enumerate();
        rows.for_each(|(node, (nodes, (re, im)))| {
            for (line, sums) in [&mut *re, &mut *im].into_iter().zip([sums_re, sums_im]) {
                let of_cell = |tap: usize| {
                    let cell = node.checked_sub(tap).filter(|_| tap < down.tap_count())?;
                    sums.get((3 * cell + tap) * width..)?.get(..width)
                };
                let lines = [0, 1, 2].map(of_cell);
                with_wide_registers(
                    #[inline(always)]
                    || lanes::add_lines(lines, &mut line[..width]),
                );
            }
            // Beyond the image the last interpolation has left its values.
            re[width..].fill(0.0);
            im[width..].fill(0.0);
            across.collect([re, im], nodes);
        });
    }

    /// Adds the light of one pixel to its nodes, as [`Self::restrict`] would.
    pub(crate) fn deposit(&self, pixel: usize, light: f32, nodes: &mut [Complex<f32>]) {
        let [across, down] = &self.axes;
        let [columns, rows] = [&across.taps[pixel % across.pixels], &down.taps[pixel / across.pixels]];
        let light = light / (across.spacing * down.spacing) as f32;
        for (row, vertical) in rows.weights[..down.tap_count()].iter().enumerate() {
            let start = (rows.first + row) * across.nodes + columns.first;
            for (node, horizontal) in nodes[start..].iter_mut().zip(&columns.weights[..across.tap_count()]) {
                *node += light * vertical * horizontal;
            }
        }
    }

    /// Distance of the nodes along a row and along a column.
    pub(crate) fn spacing(&self) -> [usize; 2] {
        self.axes.each_ref().map(Axis::spacing)
    }

    /// The spectrum of [`Self::round_trip`] away from the borders, on a torus of `size` nodes.
    pub(crate) fn round_trip_spectrum(&self, size: [usize; 2]) -> Spectrum {
        let along = |axis: usize| -> Vec<f64> {
            let middle = |diagonal: usize| f64::from(self.bands[axis][diagonal][self.axes[axis].nodes / 2]);
            let [centre, beside, second] = [middle(2), middle(3), middle(4)];
            let value = |index: usize| {
                let angle = TAU * index as f64 / size[axis] as f64;
                // The band is symmetric.
                centre + 2.0 * (beside * angle.cos() + second * (2.0 * angle).cos())
            };
            (0..size[axis]).map(value).collect()
        };
        let (across, down) = (along(0), along(1));
        let products = across.iter().flat_map(|x| down.iter().map(move |y| Complex::new(x * y, 0.0)));
        Spectrum { size, values: products.collect() }
    }

    /// What [`Self::restrict`] would make of the interpolated nodes, in place.
    pub(crate) fn round_trip(&mut self, nodes: &mut [Complex<f32>]) {
        if self.is_fine() {
            return;
        }
        let columns = self.axes[0].nodes;
        let [across, down] = &self.bands;
        let spare = &mut self.spare;
        with_wide_registers(
            #[inline(always)]
            || lanes::band_along(nodes, across, spare),
        );
        with_wide_registers(
            #[inline(always)]
            || lanes::band_across(spare, down, columns, nodes),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_round_trip_on_nodes_is_the_one_through_pixels() {
        for (size, spacing) in [([50, 37], [6, 4]), ([48, 40], [8, 1]), ([9, 30], [1, 3])] {
            let mut grid = Grid::new(size, spacing);
            let [columns, rows] = grid.size();
            let start: Vec<_> =
                (0..columns * rows).map(|i| Complex::new((i * 31 % 97) as f32, (i % 7) as f32)).collect();
            let (mut re, mut im) = (vec![0.0; size[0] * size[1]], vec![0.0; size[0] * size[1]]);
            let mut through_pixels = start.clone();
            grid.add_interpolated(&start, 1.0, &mut re, &mut im);
            grid.restrict(&re, &im, &mut through_pixels);
            let mut on_nodes = start;
            grid.round_trip(&mut on_nodes);
            for (a, b) in on_nodes.iter().zip(&through_pixels) {
                // Values below 100 in single precision, a dozen roundings.
                assert!((a - b).norm() < 1e-4, "{a} {b}, {size:?} {spacing:?}");
            }
        }
    }

    #[test]
    fn splines_carry_sum_and_position_of_light() {
        let axis = Axis::new(40, 5);
        for pixel in 0..40 {
            let node = |index: usize| (index as f64 - 1.0) * 5.0 + 2.0;
            let taps = axis.taps[pixel];
            let moment = |power: i32| -> f64 {
                let term = |k: usize| f64::from(taps.weights[k]) * (node(taps.first + k) - pixel as f64).powi(power);
                (0..3).map(term).sum()
            };
            // Weights in single precision; a quarter of the squared spacing, as `added_variance` says for both ways.
            assert!((moment(0) - 1.0).abs() < 1e-6 && moment(1).abs() < 1e-5, "pixel {pixel}");
            assert!((moment(2) - axis.added_variance() / 2.0).abs() < 1e-5, "pixel {pixel}");
        }
    }
}
