//! Spectra of kernels, in double precision; made once, when a restorer is made.

use fourier_transforms::{DoublePlanner, FftDirection, num_complex::Complex};

use crate::kernels::blobs::Kernel;
use crate::kernels::convolution::Transfer;

/// A spectrum (or an image on the torus) of `size` (columns, rows), column by column.
#[derive(Clone)]
pub(crate) struct Spectrum {
    pub(crate) size: [usize; 2],
    pub(crate) values: Vec<Complex<f64>>,
}

impl Spectrum {
    /// The spectrum of a kernel on a torus that is large enough for it.
    pub(crate) fn of_kernel(kernel: &Kernel, size: [usize; 2]) -> Self {
        let mut image = Self { size, values: vec![Complex::new(0.0, 0.0); size[0] * size[1]] };
        for ([col, row], value) in kernel.entries() {
            let wrapped = |offset: isize, axis: usize| offset.rem_euclid(size[axis] as isize) as usize;
            image.values[wrapped(col, 0) * size[1] + wrapped(row, 1)] += value;
        }
        image.transformed(FftDirection::Forward)
    }

    /// Transforms both axes; the inverse is not scaled.
    pub(crate) fn transformed(mut self, direction: FftDirection) -> Self {
        let [columns, rows] = self.size;
        let mut planner = DoublePlanner::new();
        planner.plan(rows, direction).process(&mut self.values);
        let along_rows = planner.plan(columns, direction);
        let mut line = vec![Complex::new(0.0, 0.0); columns];
        for row in 0..rows {
            for (value, column) in line.iter_mut().zip(self.values.chunks_exact(rows)) {
                *value = column[row];
            }
            along_rows.process(&mut line);
            for (value, column) in line.iter().zip(self.values.chunks_exact_mut(rows)) {
                column[row] = *value;
            }
        }
        self
    }

    pub(crate) fn map(&self, value: impl Fn(Complex<f64>) -> Complex<f64>) -> Self {
        Self { size: self.size, values: self.values.iter().map(|&v| value(v)).collect() }
    }

    pub(crate) fn times(&self, other: &Self) -> Self {
        let products = self.values.iter().zip(&other.values).map(|(a, b)| a * b);
        Self { size: self.size, values: products.collect() }
    }

    /// Factors in single precision, with the scale that forward and inverse transform need together.
    pub(crate) fn transfer(&self) -> Transfer {
        let scale = 1.0 / self.values.len() as f64;
        Transfer(self.values.iter().map(|v| Complex::new((v.re * scale) as f32, (v.im * scale) as f32)).collect())
    }
}
