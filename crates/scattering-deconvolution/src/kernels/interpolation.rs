//! From the nodes of the grid back to pixels: quadratic splines along the rows of nodes, then across them.

use fourier_transforms::num_complex::Complex;
use range_image::with_wide_registers;
use rayon::prelude::*;

use crate::kernels::grid::{Grid, ROWS_PER_TASK};
use crate::kernels::lanes;

/// Real and imaginary part with the pixels' columns and the nodes' rows.
pub(crate) type Lines = [Vec<f32>; 2];

impl Grid {
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
        self.spread_lines(nodes, factor);
        let width = self.width();
        let rows = real.par_chunks_mut(width).zip(imaginary.par_chunks_mut(width)).with_min_len(ROWS_PER_TASK);
        rows.enumerate().for_each(|(row, (re, im))| self.add_row(&self.halfway, row, [re, im]));
    }

    /// As [`Self::add_interpolated`] until [`Self::add_row`] adds the lines to each row: they take the place of `lines`.
    pub(crate) fn leave_lines(&mut self, nodes: &[Complex<f32>], factor: f32, lines: &mut Lines) {
        self.spread_lines(nodes, factor);
        if lines[0].len() != self.halfway[0].len() {
            lines.clone_from(&self.halfway);
        }
        std::mem::swap(&mut self.halfway, lines);
    }

    fn spread_lines(&mut self, nodes: &[Complex<f32>], factor: f32) {
        let across = &self.axes[0];
        let length = across.line_length();
        let [re, im] = &mut self.halfway;
        let lines = re.par_chunks_mut(length).zip(im.par_chunks_mut(length));
        let lines = lines.zip(nodes.par_chunks(across.nodes)).with_min_len(ROWS_PER_TASK);
        lines.for_each(|((re, im), nodes)| across.spread(nodes, factor, [re, im]));
    }

    /// Adds to a row of pixels what lies on lines.
    pub(crate) fn add_row(&self, lines: &Lines, row: usize, parts: [&mut [f32]; 2]) {
        let [across, down] = &self.axes;
        let (width, length, taps) = (across.pixels, across.line_length(), down.taps[row]);
        for (row, lines) in parts.into_iter().zip(lines) {
            let line = |node: usize| &lines[node * length..][..width];
            if down.spacing == 1 {
                row.iter_mut().zip(line(taps.first)).for_each(|(pixel, value)| *pixel += value);
            } else {
                let lines = [0, 1, 2].map(|tap| line(taps.first + tap));
                with_wide_registers(
                    #[inline(always)]
                    || lanes::add_weighted(row, taps.weights, lines),
                );
            }
        }
    }

    /// Shows the real part of what lies on the nodes, interpolated, row by row of pixels.
    pub(crate) fn visit_interpolated(&mut self, nodes: &[Complex<f32>], mut visit: impl FnMut(usize, &[f32])) {
        let [across, down] = &self.axes;
        let (width, length) = (across.pixels, across.line_length());
        let [re, im] = &mut self.halfway;
        let lines = re.chunks_exact_mut(length).zip(im.chunks_exact_mut(length)).zip(nodes.chunks_exact(across.nodes));
        lines.for_each(|((re, im), nodes)| across.spread(nodes, 1.0, [re, im]));
        for (index, taps) in down.taps.iter().enumerate() {
            let line = |node: usize| &re[node * length..][..width];
            if down.spacing == 1 {
                visit(index, line(taps.first));
                continue;
            }
            let (lines, row) = ([0, 1, 2].map(|tap| line(taps.first + tap)), &mut self.row);
            row.fill(0.0);
            with_wide_registers(
                #[inline(always)]
                || lanes::add_weighted(row, taps.weights, lines),
            );
            visit(index, row);
        }
    }
}
