//! Convolution of a complex image by transfer functions, with zeros outside the image.

use std::sync::Arc;

use fourier_transforms::{Fft, FftDirection, SinglePlanner, num_complex::Complex};
use rayon::prelude::*;

use crate::{Error, Result};

/// Lines transformed at a time: eight complex numbers fill the 64 bytes that memory is fetched by.
const LINES: usize = 8;
/// Numbers that one task transforms at least; smaller tasks cost more to hand out than to do.
const NUMBERS_PER_TASK: usize = 1 << 14;
/// Largest number of pixels of an image, and of numbers in the padded transform.
const MAX_PIXELS: usize = 1 << 28;

/// Factors of the spectrum, column by column, for one size of transform; scaled for the inverse transform.
pub(crate) struct Transfer(pub(crate) Vec<Complex<f32>>);

/// Plans and buffers of the two-dimensional transform of one image size.
///
/// The image is padded with zeros by the reach of the kernel, so that nothing wraps round into it. Padding rows are
/// never transformed: they are zero before, and not asked for afterwards.
pub(crate) struct Convolver {
    size: [usize; 2],
    padded: [usize; 2],
    row_plans: [Arc<dyn Fft<f32>>; 2],
    column_plans: [Arc<dyn Fft<f32>>; 2],
    rows: Vec<Complex<f32>>,
    columns: Vec<Complex<f32>>,
    row_scratch: Vec<Complex<f32>>,
    column_scratch: Vec<Complex<f32>>,
}

impl Convolver {
    /// For images of `size` (columns, rows) and kernels that reach as far as `reach`.
    pub(crate) fn new(size: [usize; 2], reach: [usize; 2]) -> Result<Self> {
        let padded = padded_size(size, reach)?;
        let mut planner = SinglePlanner::new();
        let mut plans =
            |length| [FftDirection::Forward, FftDirection::Inverse].map(|direction| planner.plan(length, direction));
        let (row_plans, column_plans) = (plans(padded[0]), plans(padded[1]));
        let zeros = |length| vec![Complex::new(0.0, 0.0); length];
        Ok(Self {
            size,
            padded,
            rows: zeros(padded[0] * size[1]),
            columns: zeros(padded[0] * padded[1]),
            row_scratch: zeros(scratch_length(&row_plans) * size[1].div_ceil(LINES)),
            column_scratch: zeros(scratch_length(&column_plans) * padded[0].div_ceil(LINES)),
            row_plans,
            column_plans,
        })
    }

    /// Columns and rows of the transform.
    pub(crate) fn padded(&self) -> [usize; 2] {
        self.padded
    }

    /// Convolves `image` (row by row) in place.
    pub(crate) fn apply(&mut self, image: &mut [Complex<f32>], transfer: &Transfer) {
        self.transform_rows(image);
        self.filter_columns(transfer);
        self.transform_rows_back(image);
    }

    fn transform_rows(&mut self, image: &[Complex<f32>]) {
        let (width, padded) = (self.size[0], self.padded[0]);
        let [forward, _] = &self.row_plans;
        self.rows
            .par_chunks_mut(LINES * padded)
            .zip(self.row_scratch.par_chunks_mut(scratch_length(&self.row_plans)))
            .zip(image.par_chunks(LINES * width))
            .with_min_len(lines_per_task(padded))
            .for_each(|((rows, scratch), image)| {
                for (row, image) in rows.chunks_exact_mut(padded).zip(image.chunks_exact(width)) {
                    let (used, padding) = row.split_at_mut(width);
                    used.copy_from_slice(image);
                    padding.fill(Complex::new(0.0, 0.0));
                }
                forward.process_with_scratch(rows, scratch);
            });
    }

    fn filter_columns(&mut self, transfer: &Transfer) {
        let (padded, height) = (self.padded, self.size[1]);
        let rows = &self.rows;
        let [forward, inverse] = &self.column_plans;
        self.columns
            .par_chunks_mut(LINES * padded[1])
            .zip(self.column_scratch.par_chunks_mut(scratch_length(&self.column_plans)))
            .zip(transfer.0.par_chunks(LINES * padded[1]))
            .with_min_len(lines_per_task(padded[1]))
            .enumerate()
            .for_each(|(block, ((columns, scratch), factors))| {
                gather(rows, padded[0], block * LINES, columns, padded[1], height);
                forward.process_with_scratch(columns, scratch);
                for (value, factor) in columns.iter_mut().zip(factors) {
                    *value *= factor;
                }
                inverse.process_with_scratch(columns, scratch);
            });
    }

    fn transform_rows_back(&mut self, image: &mut [Complex<f32>]) {
        let (width, padded) = (self.size[0], self.padded);
        let columns = &self.columns;
        let [_, inverse] = &self.row_plans;
        self.rows
            .par_chunks_mut(LINES * padded[0])
            .zip(self.row_scratch.par_chunks_mut(scratch_length(&self.row_plans)))
            .zip(image.par_chunks_mut(LINES * width))
            .with_min_len(lines_per_task(padded[0]))
            .enumerate()
            .for_each(|(block, ((rows, scratch), image))| {
                gather(columns, padded[1], block * LINES, rows, padded[0], padded[0]);
                inverse.process_with_scratch(rows, scratch);
                for (row, image) in rows.chunks_exact(padded[0]).zip(image.chunks_exact_mut(width)) {
                    image.copy_from_slice(&row[..width]);
                }
            });
    }
}

/// Copies columns `first..` of a matrix with lines of `stride` numbers into lines of `length` numbers each, of which
/// `used` are in the matrix; the rest becomes zero.
fn gather(
    matrix: &[Complex<f32>],
    stride: usize,
    first: usize,
    lines: &mut [Complex<f32>],
    length: usize,
    used: usize,
) {
    let count = lines.len() / length;
    // Squares are turned as a whole: single numbers would each go to another line.
    let squares = if count == LINES { used / LINES * LINES } else { 0 };
    for index in (0..squares).step_by(LINES) {
        let mut square = [[Complex::new(0.0, 0.0); LINES]; LINES];
        for (row, to) in square.iter_mut().enumerate() {
            to.copy_from_slice(&matrix[(index + row) * stride + first..][..LINES]);
        }
        for line in 0..LINES {
            let turned = square.map(|row| row[line]);
            lines[line * length + index..][..LINES].copy_from_slice(&turned);
        }
    }
    for (index, source) in matrix.chunks_exact(stride).enumerate().take(used).skip(squares) {
        for (line, value) in source[first..first + count].iter().enumerate() {
            lines[line * length + index] = *value;
        }
    }
    for line in lines.chunks_exact_mut(length) {
        line[used..].fill(Complex::new(0.0, 0.0));
    }
}

/// Never zero: an empty scratch could not be dealt out in chunks.
fn scratch_length(plans: &[Arc<dyn Fft<f32>>; 2]) -> usize {
    plans.iter().map(|plan| plan.get_inplace_scratch_len()).max().unwrap_or(0).max(1)
}

fn lines_per_task(length: usize) -> usize {
    (NUMBERS_PER_TASK / (LINES * length)).max(1)
}

/// Smallest good size that leaves a kernel's reach of zeros beside the image.
fn padded_size(size: [usize; 2], reach: [usize; 2]) -> Result<[usize; 2]> {
    check_size(size)?;
    // No two pixels are farther apart than this, so a longer reach needs no more room.
    let padded = [0, 1].map(|axis| good_size(size[axis] + reach[axis].min(size[axis] - 1)));
    match padded[0].checked_mul(padded[1]) {
        Some(numbers) if numbers <= MAX_PIXELS => Ok(padded),
        _ => Err(Error::ImageSize { width: size[0], height: size[1], limit: MAX_PIXELS }),
    }
}

/// Fails on images without pixels and on those that are too large to be transformed.
pub(crate) fn check_size([width, height]: [usize; 2]) -> Result<()> {
    match width.checked_mul(height) {
        Some(pixels) if (1..=MAX_PIXELS).contains(&pixels) => Ok(()),
        _ => Err(Error::ImageSize { width, height, limit: MAX_PIXELS }),
    }
}

/// Smallest number of the form `2^a 3^b 5^c` that is not below `minimum`: those transform fast.
fn good_size(minimum: usize) -> usize {
    let is_good = |mut number: usize| {
        for prime in [2, 3, 5] {
            while number.is_multiple_of(prime) {
                number /= prime;
            }
        }
        number == 1
    };
    // There is a power of two in between.
    (minimum..=2 * minimum).find(|&number| is_good(number)).unwrap_or(minimum)
}
