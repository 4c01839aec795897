//! Everything about a point spread function that is known before the first image: spectra, bounds and noise.

use std::f64::consts::TAU;

use fourier_transforms::num_complex::Complex;

use crate::kernels::blobs::Kernel;
use crate::kernels::convolution::{Convolver, Transfer};
use crate::kernels::grid::Grid;
use crate::kernels::operator::{Operator, Term};
use crate::kernels::parts::{Orientation, Part, parts};
use crate::kernels::spectrum::Spectrum;
use crate::restoration::noise::Noise;
use crate::{Error, GaussianTerm, GridSpacing, Psf, Refinement, RestorationOptions, Result};

/// Smallest `|1 + H|` that is inverted without regularisation: noise grows by its reciprocal. A choice: a hundredfold
/// of the noise is no image any more, and asks for a regularisation.
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
    pub(crate) scatter: Operator,
    /// First estimate of the scattered light, from the observed image; none where pixels do not all scatter alike.
    pub(crate) estimate: Option<Transfer>,
    /// Inverse of `1 + H`, for point spread functions whose plain iteration would not converge.
    pub(crate) inverse: Transfer,
    /// Bound of the factor by which a plain iteration shrinks the largest residual: the sum of the kernels' moduli, times
    /// the largest factors over the field.
    pub(crate) contraction: f64,
    pub(crate) noise: Noise,
}

impl Model {
    /// The model of `psf` for images of `size` pixels, with the grid and the convolution that belong to it.
    pub(crate) fn new(psf: &Psf, size: [usize; 2], options: &RestorationOptions) -> Result<(Self, Grid, Convolver)> {
        let parts = parts(psf, size)?;
        let grid = Grid::new(size, spacing(psf, size, options.grid_spacing));
        let Scattering { convolver, spectra, contraction } = Scattering::new(&parts, &grid)?;
        let stationary = matches!(&parts[..], [part] if part.is_plain());
        let lambda = options.regularisation;
        if lambda > 0.0 && !stationary {
            return Err(Error::NotStationary { what: "a regularisation" });
        }
        if options.refinement == Refinement::FilterOnly && !stationary {
            return Err(Error::NotStationary { what: "a filter without refinement" });
        }
        let mean = mean_spectrum(&parts, &spectra, convolver.padded());
        let seen = mean.times(&grid.round_trip_spectrum(convolver.padded()));
        require_invertible(&seen, lambda)?;
        let weight = |h: Complex<f64>| (1.0 + h).conj() / ((1.0 + h).norm_sqr() + lambda);
        let model = Self {
            estimate: stationary.then(|| mean.times(&seen.map(weight)).transfer()),
            inverse: seen.map(weight).transfer(),
            contraction,
            noise: Noise::new(&parts, &responses(&parts, &grid, &spectra), &grid, weight),
            scatter: operator(&parts, &spectra, &grid),
        };
        Ok((model, grid, convolver))
    }
}

/// The convolutions of all parts.
pub(crate) struct Scattering {
    pub(crate) convolver: Convolver,
    pub(crate) spectra: Vec<Spectrum>,
    pub(crate) contraction: f64,
}

impl Scattering {
    pub(crate) fn new(parts: &[Part], grid: &Grid) -> Result<Self> {
        let kernels: Vec<Kernel> = parts.iter().map(|part| part.kernel(grid)).collect();
        let farthest = |axis: usize| kernels.iter().map(|kernel| kernel.reach()[axis]).max().unwrap_or(0);
        let convolver = Convolver::new(grid.size(), [farthest(0), farthest(1)])?;
        let spectra = kernels.iter().map(|kernel| Spectrum::of_kernel(kernel, convolver.padded())).collect();
        let largest = |part: &Part| part.field.map_or(1.0, |field| field.largest(grid));
        let contraction = parts.iter().zip(&kernels).map(|(part, kernel)| largest(part) * kernel.absolute_sum()).sum();
        Ok(Self { convolver, spectra, contraction })
    }
}

/// What scatters light on the nodes.
pub(crate) fn operator(parts: &[Part], spectra: &[Spectrum], grid: &Grid) -> Operator {
    let term = |(part, spectrum): (&Part, &Spectrum)| Term {
        transfer: spectrum.transfer(),
        orientation: part.orientation,
        factors: part.field.map(|field| field.factors(grid)),
    };
    Operator::new(parts.iter().zip(spectra).map(term).collect(), grid.size().iter().product())
}

/// The spectrum that direct parts have together on the average over the field.
pub(crate) fn mean_spectrum(parts: &[Part], spectra: &[Spectrum], size: [usize; 2]) -> Spectrum {
    let mut mean = Spectrum { size, values: vec![Complex::new(0.0, 0.0); size[0] * size[1]] };
    for (part, spectrum) in parts.iter().zip(spectra).filter(|(part, _)| part.orientation == Orientation::Direct) {
        let share = part.field.map_or(1.0, |field| field.mean());
        mean.values.iter_mut().zip(&spectrum.values).for_each(|(mean, value)| *mean += value * share);
    }
    mean
}

/// Nodes as wide apart as the narrowest Gaussian that matters allows.
fn spacing(psf: &Psf, size: [usize; 2], choice: GridSpacing) -> [usize; 2] {
    let widths: Vec<GaussianTerm> = match (psf, choice) {
        (_, GridSpacing::EveryPixel) | (Psf::Kernel { .. }, _) => return [1, 1],
        (Psf::Gaussians(terms), GridSpacing::Automatic) => terms.clone(),
        (Psf::Composite(composite), GridSpacing::Automatic) => composite.widths().collect(),
    };
    [0, 1].map(|axis| {
        let lit = widths.iter().filter(|term| term.weight > 0.0);
        let narrowest = lit.map(|term| term.sigma_px[axis]).fold(f64::INFINITY, f64::min);
        ((SPACING_PER_SIGMA * narrowest) as usize).min(MAX_SPACING).min(size[axis] / MIN_CELLS).max(1)
    })
}

/// The transforms of the parts between pixels, at the frequencies of the grid.
fn responses(parts: &[Part], grid: &Grid, spectra: &[Spectrum]) -> Vec<Spectrum> {
    if grid.is_fine() {
        return spectra.to_vec();
    }
    let response = |(part, spectrum): (&Part, &Spectrum)| {
        let [columns, rows] = spectrum.size;
        let frequency = |index: usize, count: usize, axis: usize| {
            let signed = if 2 * index > count { index as f64 - count as f64 } else { index as f64 };
            TAU * signed / (count * grid.axes()[axis].spacing()) as f64
        };
        let place = |index: usize| [frequency(index / rows, columns, 0), frequency(index % rows, rows, 1)];
        let value = |index: usize| part.transform(grid, place(index)).unwrap_or(spectrum.values[index]);
        Spectrum { size: spectrum.size, values: (0..columns * rows).map(value).collect() }
    };
    parts.iter().zip(spectra).map(response).collect()
}

fn require_invertible(scatter: &Spectrum, lambda: f64) -> Result<()> {
    let response = scatter.values.iter().map(|h| (1.0 + h).norm()).fold(f64::INFINITY, f64::min);
    if lambda > 0.0 || response >= SMALLEST_RESPONSE {
        return Ok(());
    }
    Err(Error::Singular { response, limit: SMALLEST_RESPONSE })
}
