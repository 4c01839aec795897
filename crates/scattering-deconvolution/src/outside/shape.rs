//! Light that a point spread function scatters from beyond the border.

use std::f64::consts::SQRT_2;

use rustfft::num_complex::Complex;

use super::Side;
use super::blocks::Block;
use crate::{Error, GaussianTerm, Psf, Result};

/// A point spread function as Gaussians, and the depth of the strip that light comes from.
pub(super) struct Shape {
    size: [usize; 2],
    terms: Vec<GaussianTerm>,
    depth: [f64; 2],
}

/// A part of a side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Segment {
    pub(super) side: Side,
    range: [f64; 2],
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
        match segment.side {
            Side::Left => [[-0.5 - self.depth[0], -0.5], along(height)],
            Side::Right => [[width - 0.5, width - 0.5 + self.depth[0]], along(height)],
            Side::Top => [along(width), [-0.5 - self.depth[1], -0.5]],
            Side::Bottom => [along(width), [height - 0.5, height - 0.5 + self.depth[1]]],
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

    /// Light that the blocks scatter to each other.
    pub(super) fn inside(&self, blocks: &[Block]) -> Vec<Complex<f64>> {
        let density = |term: &GaussianTerm, from: &Block, to: &Block| {
            let along = |axis: usize| {
                // A block is no point: its width widens the Gaussian at both ends.
                let variance = term.sigma_px[axis].powi(2) + (from.size[axis].powi(2) + to.size[axis].powi(2)) / 12.0;
                (-0.5 * (from.place[axis] - to.place[axis]).powi(2) / variance).exp() / variance.sqrt()
            };
            term.weight * along(0) * along(1)
        };
        let received = |to: &Block| {
            let light = |from: &Block| from.light * self.terms.iter().map(|term| density(term, from, to)).sum::<f64>();
            blocks.iter().map(light).sum()
        };
        blocks.iter().map(received).collect()
    }
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
    /// All segments of all sides; each is as long as the way to the second next.
    pub(super) fn all(per_side: usize) -> Vec<Self> {
        let end = |index: usize| index as f64 / (per_side + 1) as f64;
        let of_side = |side| (0..per_side).map(move |index| Self { side, range: [end(index), end(index + 2)] });
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
