//! Light that a point spread function scatters from beyond the border.

use std::f64::consts::SQRT_2;

use fourier_transforms::num_complex::Complex;

use super::Side;
use super::blocks::Block;
use crate::{Error, GaussianTerm, Psf, Result};

/// A point spread function as Gaussians, and the mean of their standard deviations.
pub(super) struct Shape {
    size: [usize; 2],
    terms: Vec<GaussianTerm>,
    depth: [f64; 2],
}

/// Where the strip of an object may begin and end, in mean standard deviations of the point spread function from the border:
/// at the border or a little beyond, and as deep as light comes from, or twice that.
const REACHES: [[f64; 2]; 4] = [[0.0, 1.0], [0.0, 2.0], [0.25, 1.25], [0.25, 2.25]];

/// A strip beyond a part of a side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Segment {
    pub(super) side: Side,
    range: [f64; 2],
    reach: [f64; 2],
}

impl Shape {
    /// Sampled kernels become one Gaussian of their weight and width; of terms that change over the field the mean counts;
    /// ghosts do not, as they can be anywhere.
    pub(super) fn new(psf: &Psf, size: [usize; 2]) -> Result<Self> {
        psf.validate()?;
        let mut terms = match psf {
            Psf::Gaussians(terms) => terms.clone(),
            Psf::Kernel { .. } => vec![moments(psf, size)?],
            Psf::Composite(composite) => composite.mean_terms().collect(),
        };
        terms.retain(|term| term.weight > 0.0 && term.sigma_px.iter().all(|sigma| sigma.is_finite()));
        let weight: f64 = terms.iter().map(|term| term.weight).sum();
        if terms.is_empty() {
            let expected = "a point spread function that scatters nothing cannot show light from outside";
            return Err(Error::OutOfDomain { name: "weight", value: weight, expected });
        }
        let depth = [0, 1].map(|axis| terms.iter().map(|term| term.weight * term.sigma_px[axis]).sum::<f64>() / weight);
        Ok(Self { size, terms, depth })
    }

    /// Rectangle of a segment's strip in pixels: columns and rows.
    fn strip(&self, segment: Segment) -> [[f64; 2]; 2] {
        let [width, height] = self.size.map(|count| count as f64);
        let along = |length: f64| segment.range.map(|end| end * length - 0.5);
        let [near, far] = segment.reach.map(|reach| self.depth.map(|depth| reach * depth));
        match segment.side {
            Side::Left => [[-0.5 - far[0], -0.5 - near[0]], along(height)],
            Side::Right => [[width - 0.5 + near[0], width - 0.5 + far[0]], along(height)],
            Side::Top => [along(width), [-0.5 - far[1], -0.5 - near[1]]],
            Side::Bottom => [along(width), [height - 0.5 + near[1], height - 0.5 + far[1]]],
        }
    }

    /// Light that a strip of unit light gives a pixel.
    pub(super) fn light(&self, segment: Segment, place: [f64; 2]) -> f64 {
        let strip = self.strip(segment);
        let part = |term: &GaussianTerm, axis: usize| share(strip[axis], place[axis], term.sigma_px[axis]);
        self.terms.iter().map(|term| term.weight * part(term, 0) * part(term, 1)).sum()
    }

    /// The same for all pixels: of each term the factors of the columns and of the rows.
    pub(super) fn profiles(&self, segment: Segment) -> Vec<[Vec<f64>; 2]> {
        let strip = self.strip(segment);
        let along = |term: &GaussianTerm, axis: usize, weight: f64| -> Vec<f64> {
            let pixels = 0..self.size[axis];
            pixels.map(|at| weight * share(strip[axis], at as f64, term.sigma_px[axis])).collect()
        };
        self.terms.iter().map(|term| [along(term, 0, term.weight), along(term, 1, 1.0)]).collect()
    }

    /// Light that the blocks of a whole image, row by row, scatter to each other.
    pub(super) fn inside(&self, blocks: &[Block]) -> Vec<Complex<f64>> {
        let first_row = blocks.iter().filter(|block| block.index[1] == 0);
        let first_column = blocks.iter().filter(|block| block.index[0] == 0);
        let columns: Vec<_> = first_row.map(|block| (block.place[0], block.size[0])).collect();
        let rows: Vec<_> = first_column.map(|block| (block.place[1], block.size[1])).collect();
        let mut received = vec![Complex::new(0.0, 0.0); blocks.len()];
        for term in &self.terms {
            let [across, down] = [densities(&columns, term.sigma_px[0]), densities(&rows, term.sigma_px[1])];
            let along_rows: Vec<Complex<f64>> = blocks
                .chunks(columns.len().max(1))
                .flat_map(|row| {
                    across.iter().map(move |from| from.iter().zip(row).map(|(share, from)| from.light * share).sum())
                })
                .collect();
            for (to, received) in received.iter_mut().enumerate() {
                let (column, shares) = (to % columns.len(), &down[to / columns.len()]);
                let from = along_rows.iter().skip(column).step_by(columns.len());
                *received += from.zip(shares).map(|(light, share)| light * share).sum::<Complex<f64>>() * term.weight;
            }
        }
        received
    }
}

/// How densely light of each line of blocks, given by middle and width, falls on each: first where to, then where from.
fn densities(lines: &[(f64, f64)], sigma: f64) -> Vec<Vec<f64>> {
    let density = |to: &(f64, f64), from: &(f64, f64)| {
        // A block is no point: its width widens the Gaussian at both ends.
        let variance = sigma.powi(2) + (from.1.powi(2) + to.1.powi(2)) / 12.0;
        (-0.5 * (from.0 - to.0).powi(2) / variance).exp() / variance.sqrt()
    };
    lines.iter().map(|to| lines.iter().map(|from| density(to, from)).collect()).collect()
}

/// What a Gaussian about `at` has between two ends.
fn share([first, last]: [f64; 2], at: f64, sigma: f64) -> f64 {
    0.5 * (error_function((last - at) / (sigma * SQRT_2)) - error_function((first - at) / (sigma * SQRT_2)))
}

/// Abramowitz and Stegun 7.1.26, to 1.5e-7.
fn error_function(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
    let series = [1.061_405_429, -1.453_152_027, 1.421_413_741, -0.284_496_736, 0.254_829_592];
    let polynomial = series.iter().fold(0.0, |sum, coefficient| sum * t + coefficient) * t;
    (1.0 - polynomial * (-x * x).exp()).copysign(x)
}

/// The Gaussian of a kernel's weight and second moments.
fn moments(psf: &Psf, size: [usize; 2]) -> Result<GaussianTerm> {
    let kernel = psf.sample(size.map(|count| count.saturating_sub(1)))?;
    let total: f64 = kernel.values.iter().map(|value| value.abs()).sum();
    let second =
        |axis: usize| kernel.entries().map(|(at, value)| (at[axis] * at[axis]) as f64 * value.abs()).sum::<f64>();
    // A kernel of one column is as wide as a pixel.
    let sigma_px = [0, 1].map(|axis| (second(axis) / total + 1.0 / 12.0).sqrt());
    Ok(GaussianTerm { weight: total, sigma_px })
}

impl Segment {
    /// All segments of all sides and reaches; each is as long as the way to the second next.
    pub(super) fn all(per_side: usize) -> Vec<Self> {
        let end = |index: usize| index as f64 / (per_side + 1) as f64;
        let ranges = (0..per_side).map(|index| [end(index), end(index + 2)]);
        let parts = ranges.flat_map(|range| REACHES.map(|reach| (range, reach)));
        let of_side = |side| parts.clone().map(move |(range, reach)| Self { side, range, reach });
        [Side::Left, Side::Right, Side::Top, Side::Bottom].into_iter().flat_map(of_side).collect()
    }

    pub(super) fn middle(&self) -> f64 {
        f64::midpoint(self.range[0], self.range[1])
    }

    /// Pixel of the border before the middle of the segment.
    pub(super) fn nearest_pixel(&self, size: [usize; 2]) -> [f64; 2] {
        let [last_col, last_row] = size.map(|count| count as f64 - 1.0);
        let (col, row) = (self.middle() * last_col, self.middle() * last_row);
        match self.side {
            Side::Left => [0.0, row],
            Side::Right => [last_col, row],
            Side::Top => [col, 0.0],
            Side::Bottom => [col, last_row],
        }
    }
}
