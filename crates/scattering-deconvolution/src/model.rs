//! Everything about a point spread function that is known before the first image: spectra, bounds and noise.

use std::f64::consts::TAU;

use rustfft::{FftDirection, num_complex::Complex};

use crate::convolution::{Convolver, Transfer};
use crate::grid::Grid;
use crate::spectrum::Spectrum;
use crate::{Error, GaussianTerm, GridSpacing, Psf, RestorationOptions, Result};

/// Smallest `|1 + H|` that is inverted without regularisation: noise grows by its reciprocal.
const SMALLEST_RESPONSE: f64 = 0.01;
/// Spacing of the nodes in units of the narrowest Gaussian. On the nodes its standard deviation is 1.5 nodes then, so
/// that sampling it folds no more than 1e-5 of it back; at 0.75 it would be 1.1 nodes and 1e-3.
const SPACING_PER_SIGMA: f64 = 0.6;
/// Widest spacing: beyond it nothing is gained, as moving the pixels themselves takes the time.
const MAX_SPACING: usize = 8;
/// Fewest cells along an axis that is thinned out.
const MIN_CELLS: usize = 8;

/// The operators of a restoration on its grid.
pub(crate) struct Model {
    /// Scatters light on the nodes.
    pub(crate) scatter: Transfer,
    /// First estimate of the scattered light, from the observed image.
    pub(crate) estimate: Transfer,
    /// Inverse of `1 + H`, for point spread functions whose plain iteration would not converge.
    pub(crate) inverse: Transfer,
    /// Sum of the kernel's absolute values: the factor by which a plain iteration shrinks the largest residual.
    pub(crate) contraction: f64,
    pub(crate) noise: Noise,
}

/// What restoring does to noise: `var_out = (1 - 2 q(0)) var + q^2 * var` with `q` the kernel that is subtracted.
pub(crate) struct Noise {
    pub(crate) squared_kernel: Transfer,
    /// `q(0)`: what a pixel loses of itself.
    pub(crate) centre: f64,
    /// Sum of `q^2` over all other pixels.
    pub(crate) surroundings: f64,
}

impl Model {
    /// The model of `psf` for images of `size` pixels, with the grid and the convolution that belong to it.
    pub(crate) fn new(psf: &Psf, size: [usize; 2], options: &RestorationOptions) -> Result<(Self, Grid, Convolver)> {
        let grid = Grid::new(size, spacing(psf, size, options.grid_spacing));
        let nodes = grid.size();
        let kernel = on_grid(psf, &grid).sample([nodes[0] - 1, nodes[1] - 1])?;
        let convolver = Convolver::new(nodes, kernel.half_width)?;
        let scatter = Spectrum::of_kernel(&kernel, convolver.padded());
        let seen = scatter.times(&grid.round_trip_spectrum(convolver.padded()));
        let lambda = options.regularisation;
        require_invertible(&seen, lambda)?;
        let weight = |h: Complex<f64>| (1.0 + h).conj() / ((1.0 + h).norm_sqr() + lambda);
        let model = Self {
            estimate: scatter.times(&seen.map(weight)).transfer(),
            inverse: seen.map(weight).transfer(),
            contraction: kernel.values.iter().map(|value| value.abs()).sum(),
            noise: Noise::new(&response(psf, &grid, &scatter), &grid, weight),
            scatter: scatter.transfer(),
        };
        Ok((model, grid, convolver))
    }
}

impl Noise {
    fn new(response: &Spectrum, grid: &Grid, weight: impl Fn(Complex<f64>) -> Complex<f64>) -> Self {
        let subtracted = response.map(|h| h * weight(h)).transformed(FftDirection::Inverse);
        let numbers = subtracted.values.len() as f64;
        let pixels_per_node: f64 = grid.axes().iter().map(|axis| axis.spacing() as f64).product();
        let squares = subtracted.map(|q| Complex::new((q.re / numbers).powi(2) / pixels_per_node, 0.0));
        let centre = subtracted.values.first().map_or(0.0, |q| q.re / numbers / pixels_per_node);
        let energy: f64 = squares.values.iter().map(|value| value.re).sum();
        // The way to the nodes and back would make the narrow squared kernel wider: it is taken out beforehand.
        let grid_response = grid.round_trip_spectrum(squares.size).map(|value| 1.0 / value);
        Self {
            squared_kernel: squares.transformed(FftDirection::Forward).times(&grid_response).transfer(),
            centre,
            surroundings: (energy - centre * centre).max(0.0),
        }
    }

    /// Factor of the standard deviation of noise that is the same everywhere.
    pub(crate) fn gain(&self) -> f64 {
        ((1.0 - self.centre).powi(2) + self.surroundings).sqrt()
    }
}

/// Nodes as wide apart as the narrowest Gaussian that matters allows.
fn spacing(psf: &Psf, size: [usize; 2], choice: GridSpacing) -> [usize; 2] {
    let (Psf::Gaussians(terms), GridSpacing::Automatic) = (psf, choice) else { return [1, 1] };
    [0, 1].map(|axis| {
        let lit = terms.iter().filter(|term| term.weight > 0.0);
        let narrowest = lit.map(|term| term.sigma_px[axis]).fold(f64::INFINITY, f64::min);
        ((SPACING_PER_SIGMA * narrowest) as usize).min(MAX_SPACING).min(size[axis] / MIN_CELLS).max(1)
    })
}

/// The point spread function in units of nodes, narrower by what passing to the nodes and back adds.
fn on_grid(psf: &Psf, grid: &Grid) -> Psf {
    let Psf::Gaussians(terms) = psf else { return psf.clone() };
    let on_axis = |sigma: f64, axis: usize| {
        let axis = &grid.axes()[axis];
        (sigma * sigma - axis.added_variance()).sqrt() / axis.spacing() as f64
    };
    let term = |term: &GaussianTerm| {
        let [across, down] = term.sigma_px;
        GaussianTerm { weight: term.weight, sigma_px: [on_axis(across, 0), on_axis(down, 1)] }
    };
    Psf::Gaussians(terms.iter().filter(|term| term.weight > 0.0).map(term).collect())
}

/// The transform `H` of the point spread function between pixels, at the frequencies of the grid.
fn response(psf: &Psf, grid: &Grid, scatter: &Spectrum) -> Spectrum {
    let Psf::Gaussians(terms) = psf else { return scatter.clone() };
    if grid.is_fine() {
        return scatter.clone();
    }
    let [columns, rows] = scatter.size;
    let squared_frequency = |index: usize, count: usize, axis: usize| {
        let signed = if 2 * index > count { index as f64 - count as f64 } else { index as f64 };
        (TAU * signed / (count * grid.axes()[axis].spacing()) as f64).powi(2)
    };
    let value = |index: usize| {
        let across = squared_frequency(index / rows, columns, 0);
        let down = squared_frequency(index % rows, rows, 1);
        let gaussian = |t: &GaussianTerm| {
            t.weight * (-0.5 * (t.sigma_px[0].powi(2) * across + t.sigma_px[1].powi(2) * down)).exp()
        };
        Complex::new(terms.iter().map(gaussian).sum(), 0.0)
    };
    Spectrum { size: scatter.size, values: (0..columns * rows).map(value).collect() }
}

fn require_invertible(scatter: &Spectrum, lambda: f64) -> Result<()> {
    let response = scatter.values.iter().map(|h| (1.0 + h).norm()).fold(f64::INFINITY, f64::min);
    if lambda > 0.0 || response >= SMALLEST_RESPONSE {
        return Ok(());
    }
    Err(Error::Singular { response, limit: SMALLEST_RESPONSE })
}
