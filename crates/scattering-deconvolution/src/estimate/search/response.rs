//! Scattered light of one image as a function of the point spread function.
//!
//! Let d be the observed change of the light, O the pixels whose own light t may have changed. Inside O, `d = t + c` with
//! the scattered light `c = h * t`; outside of it t is zero and `d = c`. So
//!
//! ```text
//! c = h * (P d − P c)        P: nothing outside of O
//! ```
//!
//! is what scattering makes of the light observed inside O, and outside of O it is observed by itself. The first part is
//! taken pixel by pixel; c in the second, small one as its mean over blocks, times the share of the block that is in O.
//!
//! Where the phase of the light is known, P is the projection on its phasor: what is perpendicular to it is scattered
//! light and noise, and noise that were scattered would pass for scattering.

use std::f64::consts::TAU;

use nalgebra::DMatrix;

use crate::estimate::search::blur::AxisBlur;
use crate::estimate::views::blocks::Blocks;
use crate::estimate::views::planes::Planes;

/// Largest share of light that an estimate may scatter: the series of scattering again and again converges.
const LARGEST_SHARE: f64 = 0.9;
/// Steps below this share of the light are rounding.
const ROUNDING: f64 = 1e-14;
const MAX_ITERATIONS: usize = 400;

/// One Gaussian: weight and the standard deviations along a row and along a column in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::estimate) struct Term {
    pub(in crate::estimate) weight: f64,
    pub(in crate::estimate) sigma_px: [f64; 2],
}

/// Light that is scattered.
#[derive(Debug, Clone)]
pub(in crate::estimate) struct Source {
    pub(in crate::estimate) blocks: Blocks,
    /// Observed light inside O, zero outside; cropped to the columns and rows of O.
    light: Planes,
    /// First column and row of the crop.
    origin: [usize; 2],
    /// Means of P over the blocks, cropped to the blocks of O.
    coverage: [DMatrix<f64>; 3],
    block_origin: [usize; 2],
}

/// Scattered light and its derivatives, as means over blocks.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::estimate) struct Response {
    pub(in crate::estimate) scattered: Planes,
    /// With respect to each term's weight, ln of its width along a row and along a column, term by term.
    pub(in crate::estimate) derivatives: Vec<Planes>,
}

/// A symmetric matrix on (real, imaginary): diagonal, off-diagonal, diagonal.
pub(in crate::estimate) type Share = [f64; 3];

/// Light that does not belong to the source.
pub(in crate::estimate) const OUTSIDE: Share = [0.0, 0.0, 0.0];
/// Light of the source of which nothing is known.
pub(in crate::estimate) const INSIDE: Share = [1.0, 0.0, 1.0];

/// Light of the source whose phase is known.
pub(in crate::estimate) fn along(phase: f64) -> Share {
    let (sin, cos) = phase.sin_cos();
    [cos * cos, cos * sin, sin * sin]
}

impl Source {
    /// From observed light and P at each pixel, row by row. `None` where nothing is inside.
    pub(in crate::estimate) fn new(blocks: Blocks, real: &[f64], imaginary: &[f64], shares: &[Share]) -> Option<Self> {
        let [width, height] = blocks.pixels;
        let is_inside = |col: usize, row: usize| shares[row * width + col] != OUTSIDE;
        let columns = extent(width, |col| (0..height).any(|row| is_inside(col, row)))?;
        let rows = extent(height, |row| (0..width).any(|col| is_inside(col, row)))?;
        let crop = |part: [usize; 2]| {
            DMatrix::from_fn(columns.1 - columns.0, rows.1 - rows.0, |col, row| {
                let pixel = (row + rows.0) * width + col + columns.0;
                let share = |place: usize| shares[pixel][place];
                share(part[0]) * real[pixel] + share(part[1]) * imaginary[pixel]
            })
        };
        let block_origin = [columns.0 / blocks.edge, rows.0 / blocks.edge];
        let size = [columns.1.div_ceil(blocks.edge), rows.1.div_ceil(blocks.edge)];
        let coverage = [0, 1, 2].map(|place| {
            DMatrix::from_fn(size[0] - block_origin[0], size[1] - block_origin[1], |col, row| {
                let pixels = blocks.pixels_of([col + block_origin[0], row + block_origin[1]]);
                let (sum, count) = pixels.fold((0.0, 0.0), |(sum, n), pixel| (sum + shares[pixel][place], n + 1.0));
                sum / count
            })
        });
        let light = Planes { real: crop([0, 1]), imaginary: crop([1, 2]) };
        Some(Self { blocks, light, origin: [columns.0, rows.0], coverage, block_origin })
    }

    /// Light scattered by a Gaussian of weight one when the light of O is scattered once, and its derivatives with
    /// respect to the logarithms of its widths where they are wanted.
    fn once(&self, blurs: &[AxisBlur; 2], derivatives: bool) -> Vec<Planes> {
        let crop = |axis: usize, kind: usize| {
            let length = [self.light.real.nrows(), self.light.real.ncols()][axis];
            blurs[axis].from_pixels[kind].columns(self.origin[axis], length).into_owned()
        };
        let (x, y) = (crop(0, 0), crop(1, 0).transpose());
        let half = self.light.map(|plane| plane * &y);
        let mut out = vec![half.map(|plane| &x * plane)];
        if derivatives {
            let (x_slope, y_slope) = (crop(0, 1), crop(1, 1).transpose());
            out.push(half.map(|plane| &x_slope * plane));
            out.push(self.light.map(|plane| &x * (plane * &y_slope)));
        }
        out
    }

    /// `G (P c)` on all blocks, by given matrices of the two axes.
    fn again(&self, [x, y]: [&DMatrix<f64>; 2], scattered: &Planes) -> Planes {
        let [across, mixed, down] = &self.coverage;
        let (columns, rows) = mixed.shape();
        let start = (self.block_origin[0], self.block_origin[1]);
        let (x, y) = (x.columns(start.0, columns), y.columns(start.1, rows));
        let [re, im] = [&scattered.real, &scattered.imaginary].map(|plane| plane.view(start, (columns, rows)));
        let lit = Planes {
            real: re.component_mul(across) + im.component_mul(mixed),
            imaginary: re.component_mul(mixed) + im.component_mul(down),
        };
        lit.map(|plane| x * (plane * y.transpose()))
    }

    /// Solves `c = first − h * (P c)` by scattering again and again.
    fn settle(&self, terms: &[Term], blurs: &[[AxisBlur; 2]], first: &Planes) -> Option<Planes> {
        let mut scattered = first.clone();
        for _ in 0..MAX_ITERATIONS {
            let mut next = first.clone();
            for (term, [x, y]) in terms.iter().zip(blurs) {
                next.add(-term.weight, &self.again([&x.from_blocks[0], &y.from_blocks[0]], &scattered));
            }
            scattered.add(-1.0, &next);
            let step = scattered.largest();
            let size = next.largest();
            scattered = next;
            if step <= ROUNDING * size {
                return Some(scattered);
            }
        }
        None
    }

    /// Scattered light for these terms; `None` where they scatter more than can be.
    pub(in crate::estimate) fn response(&self, terms: &[Term], derivatives: bool) -> Option<Response> {
        let pixels = (self.blocks.pixels[0] * self.blocks.pixels[1]) as f64;
        // Of a Gaussian wider than the image no more stays inside than its height on all pixels.
        let inside = |term: &Term| (pixels / (TAU * term.sigma_px[0] * term.sigma_px[1])).min(1.0);
        let share: f64 = terms.iter().map(|term| term.weight.abs() * inside(term)).sum();
        if share.is_nan() || share > LARGEST_SHARE {
            return None;
        }
        let blur = |term: &Term| [0, 1].map(|axis| AxisBlur::new(&self.blocks, axis, term.sigma_px[axis]));
        let blurs: Vec<[AxisBlur; 2]> = terms.iter().map(blur).collect();
        let once: Vec<Vec<Planes>> = blurs.iter().map(|blurs| self.once(blurs, derivatives)).collect();
        let mut first = Planes::zeros(self.blocks.count());
        for (term, once) in terms.iter().zip(&once) {
            first.add(term.weight, &once[0]);
        }
        let scattered = self.settle(terms, &blurs, &first)?;
        let mut out = Response { scattered, derivatives: Vec::new() };
        if derivatives {
            for ((term, pair), once) in terms.iter().zip(&blurs).zip(once) {
                for (kind, mut planes) in once.into_iter().enumerate() {
                    let [x, y] = pair;
                    let matrices = [&x.from_blocks[usize::from(kind == 1)], &y.from_blocks[usize::from(kind == 2)]];
                    planes.add(-1.0, &self.again(matrices, &out.scattered));
                    let settled = self.settle(terms, &blurs, &planes)?;
                    let factor = if kind == 0 { 1.0 } else { term.weight };
                    out.derivatives.push(settled.map(|plane| plane * factor));
                }
            }
        }
        Some(out)
    }

    /// Light scattered once by a round Gaussian of weight one: the dictionary from which starts are taken.
    pub(in crate::estimate) fn first_order(&self, sigma_px: f64) -> Option<Planes> {
        let blurs = [0, 1].map(|axis| AxisBlur::new(&self.blocks, axis, sigma_px));
        self.once(&blurs, false).pop()
    }
}

/// First and one past the last index that is set.
fn extent(length: usize, is_set: impl Fn(usize) -> bool) -> Option<(usize, usize)> {
    let first = (0..length).find(|&index| is_set(index))?;
    let last = (first..length).rev().find(|&index| is_set(index))?;
    Some((first, last + 1))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::{GaussianTerm, Psf, Scatterer};

    const SIZE: [usize; 2] = [50, 37];
    const TERMS: [Term; 2] =
        [Term { weight: 0.05, sigma_px: [4.0, 5.0] }, Term { weight: 0.08, sigma_px: [15.0, 11.0] }];

    /// Light of a textured object, and what is observed of it.
    fn scattered() -> (Vec<bool>, Vec<f64>, Vec<f64>) {
        let inside: Vec<bool> = (0..SIZE[0] * SIZE[1]).map(|i| i % SIZE[0] < 17 && i / SIZE[0] > 21).collect();
        let lit = |i: usize, inside: bool| if inside { 1000.0 + ((i * 37) % 101) as f32 } else { 0.0 };
        let real: Vec<f32> = inside.iter().enumerate().map(|(i, &inside)| lit(i, inside)).collect();
        let imaginary: Vec<f32> = real.iter().map(|value| 0.4 * value).collect();
        let (mut re, mut im) = (real, imaginary);
        let term = |term: &Term| GaussianTerm { weight: term.weight, sigma_px: term.sigma_px };
        let psf = Psf::Gaussians(TERMS.iter().map(term).collect());
        Scatterer::new(&psf, SIZE[0], SIZE[1]).unwrap().apply(&mut re, &mut im).unwrap();
        let wide = |plane: Vec<f32>| plane.into_iter().map(f64::from).collect();
        (inside, wide(re), wide(im))
    }

    fn source(edge: usize) -> (Source, Vec<bool>, Vec<f64>) {
        let (inside, re, im) = scattered();
        let shares: Vec<Share> = inside.iter().map(|inside| if *inside { INSIDE } else { OUTSIDE }).collect();
        let blocks = Blocks::new(SIZE, Some(edge));
        (Source::new(blocks, &re, &im, &shares).unwrap(), inside, re)
    }

    #[test]
    fn the_response_is_what_is_scattered() {
        for (edge, tolerance) in [(1, 4e-4), (3, 4e-4), (4, 5e-4)] {
            let (source, inside, observed) = source(edge);
            let response = source.response(&TERMS, false).unwrap();
            let blocks = source.blocks;
            let outside = blocks.all().filter(|&block| blocks.pixels_of(block).all(|pixel| !inside[pixel]));
            let mut largest = 0.0_f64;
            for block in outside {
                let (sum, count) =
                    blocks.pixels_of(block).fold((0.0, 0.0), |(sum, n), pixel| (sum + observed[pixel], n + 1.0));
                largest = largest.max((sum / count - response.scattered.real[(block[0], block[1])]).abs());
            }
            let brightest = response.scattered.largest();
            // The forward model ends its Gaussians at four standard deviations (exp(-8) = 3.4e-4 of their height), and
            // light scattered twice is taken in blocks.
            assert!(largest < tolerance * brightest, "edge {edge}: {largest} of {brightest}");
        }
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let (source, ..) = source(4);
        let response = source.response(&TERMS, true).unwrap();
        for (index, derivative) in response.derivatives.iter().enumerate() {
            let moved = |step: f64| {
                let mut terms = TERMS;
                let term = &mut terms[index / 3];
                match index % 3 {
                    0 => term.weight += step,
                    axis => term.sigma_px[axis - 1] *= step.exp(),
                }
                source.response(&terms, false).unwrap().scattered
            };
            let step = 1e-4;
            let mut difference = moved(step);
            difference.add(-1.0, &moved(-step));
            let mut error = difference.map(|plane| plane / (2.0 * step));
            error.add(-1.0, derivative);
            // Central differences are wrong by step^2 / 6 of the third derivative.
            assert!(error.largest() < 1e-7 * derivative.largest().max(1.0), "{index}: {}", error.largest());
        }
    }

    #[test]
    fn more_light_than_there_is_has_no_response() {
        let (source, ..) = source(4);
        for weight in [3.0, f64::NAN] {
            assert!(source.response(&[Term { weight, sigma_px: [3.0, 3.0] }], false).is_none());
        }
        assert!(Source::new(Blocks::new([3, 2], None), &[0.0; 6], &[0.0; 6], &[OUTSIDE; 6]).is_none());
    }
}
