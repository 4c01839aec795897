//! Kernels as sums of Gaussians that may lie beside the centre and have a phase.

use std::f64::consts::TAU;

use fourier_transforms::num_complex::Complex;

use crate::{GAUSSIAN_CUT_SIGMAS, GaussianTerm, SampledKernel};

/// A Gaussian somewhere, in units of whatever grid it is sampled on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Blob {
    pub(crate) weight: Complex<f64>,
    pub(crate) sigma: [f64; 2],
    pub(crate) offset: [f64; 2],
}

impl From<&GaussianTerm> for Blob {
    fn from(term: &GaussianTerm) -> Self {
        Self { weight: Complex::new(term.weight, 0.0), sigma: term.sigma_px, offset: [0.0; 2] }
    }
}

impl Blob {
    /// Transform at an angular frequency.
    pub(crate) fn transform(&self, frequency: [f64; 2]) -> Complex<f64> {
        let squares = [0, 1].map(|axis| (self.sigma[axis] * frequency[axis]).powi(2));
        let angle = self.offset[0] * frequency[0] + self.offset[1] * frequency[1];
        self.weight * Complex::from_polar((-0.5 * (squares[0] + squares[1])).exp(), -angle)
    }

    /// Whole offsets inside the cut and the limit, first and one past the last; empty where nothing is left.
    fn span(&self, axis: usize, limit: usize) -> [isize; 2] {
        let reach = (GAUSSIAN_CUT_SIGMAS * self.sigma[axis]).ceil();
        let limit = limit as f64;
        let first = (self.offset[axis] - reach).ceil().clamp(-limit, limit + 1.0);
        let last = (self.offset[axis] + reach).floor().clamp(-limit - 1.0, limit);
        [first as isize, (last as isize + 1).max(first as isize)]
    }

    /// Samples along one axis at whole offsets, zero outside `inside`; over the infinite line they sum to one.
    fn profile(&self, axis: usize, span: [isize; 2], inside: [isize; 2]) -> Vec<f64> {
        let (sigma, offset) = (self.sigma[axis], self.offset[axis]);
        let value = |at: f64| (-0.5 * ((at - offset) / sigma).powi(2)).exp();
        let nearest = offset.round();
        // By Poisson's sum formula the samples sum to sigma sqrt(2 pi) up to 2 exp(-2 pi^2 sigma^2): 1e-34 at sigma 2.
        // A Gaussian so narrow that no sample sees it gives its light to the nearest.
        let sum =
            if sigma >= 2.0 { sigma * TAU.sqrt() } else { (-40..=40).map(|i| value(nearest + f64::from(i))).sum() };
        let sample = |at: isize| match (inside[0]..inside[1]).contains(&at) {
            false => 0.0,
            true if sum > 0.0 => value(at as f64) / sum,
            true => f64::from(u8::from((at as f64 - nearest).abs() < 0.5)),
        };
        (span[0]..span[1]).map(sample).collect()
    }
}

/// A kernel at whole offsets, row by row.
#[derive(Debug, Clone)]
pub(crate) struct Kernel {
    /// Offset of the first value along a row and along a column.
    pub(crate) first: [isize; 2],
    pub(crate) size: [usize; 2],
    pub(crate) values: Vec<Complex<f64>>,
}

impl From<SampledKernel> for Kernel {
    fn from(kernel: SampledKernel) -> Self {
        Self {
            first: kernel.half_width.map(|half| -(half as isize)),
            size: kernel.half_width.map(|half| 2 * half + 1),
            values: kernel.values.iter().map(|&value| Complex::new(value, 0.0)).collect(),
        }
    }
}

impl Kernel {
    /// Samples Gaussians out to `limit` along a row and along a column.
    pub(crate) fn of_blobs(blobs: &[Blob], limit: [usize; 2]) -> Self {
        let spans: Vec<[[isize; 2]; 2]> =
            blobs.iter().map(|blob| [0, 1].map(|axis| blob.span(axis, limit[axis]))).collect();
        let whole = [0, 1].map(|axis| {
            let lit = spans.iter().filter(|span| span.iter().all(|[first, end]| first < end)).map(|span| span[axis]);
            lit.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).unwrap_or([0, 1])
        });
        let size = whole.map(|[first, end]| (end - first) as usize);
        let mut values = vec![Complex::new(0.0, 0.0); size[0] * size[1]];
        for (blob, inside) in blobs.iter().zip(&spans) {
            let [along_row, along_column] = [0, 1].map(|axis| blob.profile(axis, whole[axis], inside[axis]));
            for (row, vertical) in values.chunks_exact_mut(size[0]).zip(&along_column) {
                for (value, horizontal) in row.iter_mut().zip(&along_row) {
                    *value += blob.weight * (vertical * horizontal);
                }
            }
        }
        Self { first: whole.map(|[first, _]| first), size, values }
    }

    /// Offsets `(columns, rows)` and values, row by row.
    pub(crate) fn entries(&self) -> impl Iterator<Item = ([isize; 2], Complex<f64>)> {
        let place = |index: usize| [index % self.size[0], index / self.size[0]];
        let offset = move |index| [0, 1].map(|axis| self.first[axis] + place(index)[axis] as isize);
        self.values.iter().enumerate().map(move |(index, &value)| (offset(index), value))
    }

    /// Farthest offset along a row and along a column.
    pub(crate) fn reach(&self) -> [usize; 2] {
        [0, 1].map(|axis| {
            let last = self.first[axis] + self.size[axis] as isize - 1;
            self.first[axis].unsigned_abs().max(last.unsigned_abs())
        })
    }

    /// Sum of the moduli: the largest factor by which convolving makes the largest value larger.
    pub(crate) fn absolute_sum(&self) -> f64 {
        self.values.iter().map(|value| value.norm()).sum()
    }
}
