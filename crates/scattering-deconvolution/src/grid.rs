//! The grid on which scattered light is computed: that of the pixels, or a wider one that carries smooth light as well.
//!
//! Between pixels and wide grid stand quadratic B-splines: their first two moments do not depend on where a pixel lies
//! between the nodes, so that passing through them widens a Gaussian by a known amount and does nothing else up to the
//! third order.

use std::f64::consts::TAU;

use rayon::prelude::*;
use rustfft::num_complex::Complex;

use crate::spectrum::Spectrum;

/// Rows of pixels that one task takes at least; smaller tasks cost more to hand out than to do.
const ROWS_PER_TASK: usize = 16;

/// One image axis: its pixels and its nodes.
pub(crate) struct Axis {
    pixels: usize,
    nodes: usize,
    spacing: usize,
    taps: Vec<Taps>,
}

/// The nodes that a pixel belongs to: the first of `Axis::tap_count` in a row, and the weight of each.
#[derive(Clone, Copy)]
struct Taps {
    first: usize,
    weights: [f32; 3],
}

impl Axis {
    /// Nodes `spacing` pixels apart, with one node more beyond each end; the pixels themselves for spacing 1.
    pub(crate) fn new(pixels: usize, spacing: usize) -> Self {
        if spacing <= 1 {
            let taps = (0..pixels).map(|first| Taps { first, weights: [1.0, 0.0, 0.0] }).collect();
            return Self { pixels, nodes: pixels, spacing: 1, taps };
        }
        let taps = (0..pixels).map(|pixel| {
            let (cell, within) = (pixel / spacing, pixel % spacing);
            let u = (within as f64 + 0.5) / spacing as f64 - 0.5;
            let weights = [0.5 * (0.5 - u).powi(2), 0.75 - u * u, 0.5 * (0.5 + u).powi(2)];
            Taps { first: cell, weights: weights.map(|weight| weight as f32) }
        });
        Self { pixels, nodes: pixels.div_ceil(spacing) + 2, spacing, taps: taps.collect() }
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

    /// Sums a row of pixels into its nodes.
    fn collect(&self, re: &[f32], im: &[f32], nodes: &mut [Complex<f32>]) {
        nodes.fill(Complex::new(0.0, 0.0));
        for (cell, (re, im)) in re.chunks(self.spacing).zip(im.chunks(self.spacing)).enumerate() {
            let mut sums = [Complex::new(0.0, 0.0); 3];
            for (taps, (re, im)) in self.taps.iter().zip(re.iter().zip(im)) {
                for (sum, weight) in sums.iter_mut().zip(taps.weights) {
                    *sum += Complex::new(weight * re, weight * im);
                }
            }
            for (node, sum) in nodes[cell..].iter_mut().zip(&sums[..self.tap_count()]) {
                *node += sum;
            }
        }
    }

    /// Interpolates a row of nodes at its pixels, times `factor`.
    fn spread(&self, nodes: &[Complex<f32>], factor: f32, re: &mut [f32], im: &mut [f32]) {
        for (cell, (re, im)) in re.chunks_mut(self.spacing).zip(im.chunks_mut(self.spacing)).enumerate() {
            let node = |index: usize| nodes.get(cell + index).map_or(Complex::new(0.0, 0.0), |node| node * factor);
            let [first, second, third] = [node(0), node(1), node(2)];
            for (taps, (re, im)) in self.taps.iter().zip(re.iter_mut().zip(im)) {
                let [a, b, c] = taps.weights;
                *re = a * first.re + b * second.re + c * third.re;
                *im = a * first.im + b * second.im + c * third.im;
            }
        }
    }

    /// Pixels that belong to a node.
    fn pixels_of(&self, node: usize) -> std::ops::Range<usize> {
        let cells = (node + 1).saturating_sub(self.tap_count())..node + 1;
        (cells.start * self.spacing).min(self.pixels)..(cells.end * self.spacing).min(self.pixels)
    }

    /// Nodes to pixels and back to nodes: the band matrix of five diagonals, row by row.
    fn round_trip(&self) -> Vec<[f32; 5]> {
        let entry = |row: usize, diagonal: usize| {
            let Some(column) = (row + diagonal).checked_sub(2) else { return 0.0 };
            let pixels = self.pixels_of(row);
            let products = pixels.filter_map(|p| Some(self.weight(p, row)? * self.weight(p, column)?));
            products.sum::<f32>() / self.spacing as f32
        };
        (0..self.nodes).map(|row| std::array::from_fn(|diagonal| entry(row, diagonal))).collect()
    }
}

/// Both axes, with the buffers between them.
pub(crate) struct Grid {
    axes: [Axis; 2],
    bands: [Vec<[f32; 5]>; 2],
    /// Real and imaginary part with the pixels' columns and the nodes' rows.
    halfway: [Vec<f32>; 2],
    spare: Vec<Complex<f32>>,
}

impl Grid {
    pub(crate) fn new(size: [usize; 2], spacing: [usize; 2]) -> Self {
        let axes = [0, 1].map(|axis| Axis::new(size[axis], spacing[axis]));
        let bands = [axes[0].round_trip(), axes[1].round_trip()];
        let halfway = [(); 2].map(|()| vec![0.0; axes[0].pixels * axes[1].nodes]);
        let spare = vec![Complex::new(0.0, 0.0); axes[0].nodes * axes[1].nodes];
        Self { axes, bands, halfway, spare }
    }

    pub(crate) fn axes(&self) -> &[Axis; 2] {
        &self.axes
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
        let scale = 1.0 / (across.spacing * down.spacing) as f32;
        for (plane, halfway) in [real, imaginary].into_iter().zip(&mut self.halfway) {
            halfway.par_chunks_mut(across.pixels).enumerate().for_each(|(node, sums)| {
                let pixels = down.pixels_of(node);
                let rows = &plane[pixels.start * across.pixels..pixels.end * across.pixels];
                let weight = |row: usize| scale * down.weight(pixels.start + row, node).unwrap_or(0.0);
                sum_rows(rows, weight, sums);
            });
        }
        let [re, im] = &self.halfway;
        let lines = re.par_chunks(across.pixels).zip(im.par_chunks(across.pixels));
        nodes.par_chunks_mut(across.nodes).zip(lines).for_each(|(nodes, (re, im))| across.collect(re, im, nodes));
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

    /// Adds `factor` times what lies on the nodes to planes of pixels: quadratic spline.
    pub(crate) fn add_interpolated(
        &mut self,
        nodes: &[Complex<f32>],
        factor: f32,
        real: &mut [f32],
        imaginary: &mut [f32],
    ) {
        if self.is_fine() {
            for (node, (re, im)) in nodes.iter().zip(real.iter_mut().zip(imaginary)) {
                *re += factor * node.re;
                *im += factor * node.im;
            }
            return;
        }
        let [across, down] = &self.axes;
        let [halfway_re, halfway_im] = &mut self.halfway;
        let lines = halfway_re.par_chunks_mut(across.pixels).zip(halfway_im.par_chunks_mut(across.pixels));
        lines.zip(nodes.par_chunks(across.nodes)).for_each(|((re, im), nodes)| across.spread(nodes, factor, re, im));
        for (plane, halfway) in [real, imaginary].into_iter().zip(&self.halfway) {
            let line = |node: usize| &halfway[node * across.pixels..][..across.pixels];
            plane.par_chunks_mut(across.pixels).with_min_len(ROWS_PER_TASK).zip(&down.taps).for_each(|(row, taps)| {
                match (down.tap_count(), taps.weights) {
                    (1, _) => row.iter_mut().zip(line(taps.first)).for_each(|(pixel, value)| *pixel += value),
                    (_, [a, b, c]) => {
                        let lines = line(taps.first).iter().zip(line(taps.first + 1)).zip(line(taps.first + 2));
                        for (pixel, ((first, second), third)) in row.iter_mut().zip(lines) {
                            *pixel += a * first + b * second + c * third;
                        }
                    }
                }
            });
        }
    }

    /// The spectrum of [`Self::round_trip`] away from the borders, on a torus of `size` nodes.
    pub(crate) fn round_trip_spectrum(&self, size: [usize; 2]) -> Spectrum {
        let along = |axis: usize| -> Vec<f64> {
            let middle = &self.bands[axis][self.axes[axis].nodes / 2];
            let value = |index: usize| {
                let angle = TAU * index as f64 / size[axis] as f64;
                // The band is symmetric.
                f64::from(middle[2])
                    + 2.0 * (f64::from(middle[3]) * angle.cos() + f64::from(middle[4]) * (2.0 * angle).cos())
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
        let [columns, rows] = self.size();
        let [across, down] = &self.bands;
        let band = |band: &[f32; 5], value: &dyn Fn(usize) -> Option<Complex<f32>>, at: usize| -> Complex<f32> {
            let inside =
                band.iter().enumerate().filter_map(|(d, weight)| Some(value((at + d).checked_sub(2)?)? * weight));
            inside.sum()
        };
        for (target, line) in self.spare.chunks_exact_mut(columns).zip(nodes.chunks_exact(columns)) {
            for (col, target) in target.iter_mut().enumerate() {
                *target = band(&across[col], &|at| line.get(at).copied(), col);
            }
        }
        for row in 0..rows {
            for col in 0..columns {
                let value = |at: usize| (at < rows).then(|| self.spare[at * columns + col]);
                nodes[row * columns + col] = band(&down[row], &value, row);
            }
        }
    }
}

/// Weighted sum of rows that lie one after the other, each as long as `sums`; four at a time, to write the sums less
/// often.
fn sum_rows(rows: &[f32], weight: impl Fn(usize) -> f32, sums: &mut [f32]) {
    sums.fill(0.0);
    let width = sums.len();
    for (group, rows) in rows.chunks(4 * width).enumerate() {
        let weight = |row: usize| weight(4 * group + row);
        if rows.len() == 4 * width {
            let [a, b, c, d] = [weight(0), weight(1), weight(2), weight(3)];
            let (upper, lower) = rows.split_at(2 * width);
            let ((first, second), (third, fourth)) = (upper.split_at(width), lower.split_at(width));
            let values = first.iter().zip(second).zip(third).zip(fourth);
            for (sum, (((first, second), third), fourth)) in sums.iter_mut().zip(values) {
                *sum += a * first + b * second + c * third + d * fourth;
            }
        } else {
            for (index, row) in rows.chunks_exact(width).enumerate() {
                let weight = weight(index);
                sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += weight * value);
            }
        }
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
