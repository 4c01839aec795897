//! Restoration of complex images.

use range_image::{ComplexChannel, Flags, Raster};
use rustfft::num_complex::Complex;

use crate::convolution::{Convolver, check_size};
use crate::grid::Grid;
use crate::mask::{Mask, largest_part};
use crate::model::Model;
use crate::{Error, Psf, RestorationOptions, Result};

/// Contraction up to which light is simply scattered again; beyond it each step is divided by `1 + H` as well.
const PLAIN_ITERATION: f64 = 0.5;

/// What a restoration did, and how well.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RestorationSummary {
    /// Iterations after the first estimate.
    pub iterations: usize,
    /// Bound of the residual `|y - (z + psf * z)|` that remains, over the largest real or imaginary part of `y`.
    pub residual: f64,
    /// Factor by which the standard deviation of noise that is the same everywhere changes.
    pub noise_gain: f64,
    /// Pixels that kept their value: not finite, or saturated where flags were given.
    pub kept_pixels: usize,
    /// Those of them that had no finite value and were filled from their neighbours while light was computed.
    pub filled_pixels: usize,
    /// Distance of the nodes on which scattered light was computed, along a row and along a column, in pixels.
    pub grid_spacing: [usize; 2],
}

/// Undoes scattering in complex images of one size.
///
/// Solves `z + psf * z = y` for the light `z` that each pixel would have had, nothing being outside the image: first
/// by the inverse filter, which is right but for the light that was lost over the image border, then by iteration until
/// the residual is below the tolerance. Made once for a size of image; all buffers are its own, so that restoring
/// allocates nothing after the first image.
pub struct Restorer {
    pub(crate) size: [usize; 2],
    options: RestorationOptions,
    pub(crate) work: Option<Work>,
    mask: Mask,
}

/// Buffers and operators of a point spread function that scatters something.
pub(crate) struct Work {
    pub(crate) model: Model,
    pub(crate) grid: Grid,
    pub(crate) convolver: Convolver,
    /// Observed light on the nodes.
    observed: Vec<Complex<f32>>,
    /// Scattered light on the nodes.
    scattered: Vec<Complex<f32>>,
    pub(crate) spare: Vec<Complex<f32>>,
    pub(crate) variance: [Vec<f32>; 2],
}

impl Restorer {
    /// For images of `width` x `height` pixels.
    pub fn new(psf: &Psf, width: usize, height: usize, options: &RestorationOptions) -> Result<Self> {
        psf.validate()?;
        options.validate()?;
        let size = [width, height];
        check_size(size)?;
        let work = if psf.is_empty() { None } else { Some(Work::new(psf, size, options)?) };
        Ok(Self { size, options: *options, work, mask: Mask::default() })
    }

    /// Restores one complex image in place and propagates its sigma. Where it fails, the image stays as it was.
    ///
    /// Pixels that are not finite keep their value and disturb no other.
    pub fn restore(&mut self, channel: &mut ComplexChannel) -> Result<RestorationSummary> {
        self.restore_channel(channel, |_| false)
    }

    /// As [`Self::restore`]; pixels that are flagged as saturated or without data keep their value as well. The clipped
    /// light of saturated pixels counts as scattering.
    pub fn restore_flagged(
        &mut self,
        channel: &mut ComplexChannel,
        flags: &Raster<Flags>,
    ) -> Result<RestorationSummary> {
        channel.real.require_same_size(flags, "flags")?;
        let untouched = Flags::SATURATED | Flags::NO_DATA;
        self.restore_channel(channel, |pixel| flags.as_slice()[pixel].intersects(untouched))
    }

    /// Restores the two planes (row by row) of an image without sigma.
    pub fn restore_planes(&mut self, real: &mut [f32], imaginary: &mut [f32]) -> Result<RestorationSummary> {
        self.restore_kept(real, imaginary, |_| false)
    }

    fn restore_channel(
        &mut self,
        channel: &mut ComplexChannel,
        keep: impl Fn(usize) -> bool,
    ) -> Result<RestorationSummary> {
        channel.validate()?;
        let size = [channel.real.width(), channel.real.height()];
        if size != self.size {
            let [width, height] = self.size;
            let [found_width, found_height] = size;
            let what = "the image";
            return Err(range_image::Error::SizeMismatch { what, width, height, found_width, found_height }.into());
        }
        let (real, imaginary) = (&mut channel.real, &mut channel.imaginary);
        let summary = self.restore_kept(real.as_mut_slice(), imaginary.as_mut_slice(), keep)?;
        if let Some(work) = &mut self.work {
            work.propagate_sigma(channel.sigma.as_mut_slice(), &self.mask);
        }
        Ok(summary)
    }

    fn restore_kept(
        &mut self,
        real: &mut [f32],
        imaginary: &mut [f32],
        keep: impl Fn(usize) -> bool,
    ) -> Result<RestorationSummary> {
        let expected = self.size[0] * self.size[1];
        for (what, plane) in [("real part", &*real), ("imaginary part", &*imaginary)] {
            if plane.len() != expected {
                return Err(Error::PlaneLength { what, expected, found: plane.len() });
            }
        }
        self.mask.put_aside(self.size[0], real, imaginary, keep);
        let outcome = match &mut self.work {
            Some(work) => work.solve(real, imaginary, &self.options),
            None => Ok((0, 0.0)),
        };
        if let (Some(work), Ok(_)) = (&mut self.work, &outcome) {
            work.grid.add_interpolated(&work.scattered, -1.0, real, imaginary);
        }
        self.mask.put_back(real, imaginary);
        let (iterations, residual) = outcome?;
        Ok(RestorationSummary {
            iterations,
            residual,
            noise_gain: self.work.as_ref().map_or(1.0, |work| work.model.noise.gain()),
            kept_pixels: self.mask.kept(),
            filled_pixels: self.mask.filled(),
            grid_spacing: self.work.as_ref().map_or([1, 1], |work| [0, 1].map(|i| work.grid.axes()[i].spacing())),
        })
    }
}

impl Work {
    fn new(psf: &Psf, size: [usize; 2], options: &RestorationOptions) -> Result<Self> {
        let (model, grid, convolver) = Model::new(psf, size, options)?;
        let [columns, rows] = grid.size();
        let zeros = vec![Complex::new(0.0, 0.0); columns * rows];
        let (observed, scattered, spare) = (zeros.clone(), zeros.clone(), zeros);
        Ok(Self { model, grid, convolver, observed, scattered, spare, variance: [Vec::new(), Vec::new()] })
    }

    /// Finds the scattered light; iterations made and bound of the relative residual.
    fn solve(&mut self, real: &[f32], imaginary: &[f32], options: &RestorationOptions) -> Result<(usize, f64)> {
        self.grid.restrict(real, imaginary, &mut self.observed);
        self.scattered.copy_from_slice(&self.observed);
        self.convolver.apply(&mut self.scattered, &self.model.estimate);
        let largest = f64::from(largest_part(real).max(largest_part(imaginary)));
        let tolerance = options.tolerance;
        let mut residual = f64::INFINITY;
        for iterations in 0..=options.max_iterations {
            residual = relative(self.find_residual(), largest);
            let bound = self.model.contraction * residual;
            if residual <= tolerance || options.regularisation > 0.0 && residual.is_finite() {
                return Ok((iterations, residual));
            }
            if self.is_plain() && bound <= tolerance {
                self.step();
                return Ok((iterations + 1, bound));
            }
            if !residual.is_finite() {
                break;
            }
            self.step();
        }
        Err(Error::NotConverged { iterations: options.max_iterations, residual, tolerance })
    }

    fn is_plain(&self) -> bool {
        self.model.contraction <= PLAIN_ITERATION
    }

    /// Puts `psf * (y - c) - c` into the spare image, `c` being the scattered light, and returns its largest modulus.
    fn find_residual(&mut self) -> f64 {
        self.spare.copy_from_slice(&self.scattered);
        self.grid.round_trip(&mut self.spare);
        for (light, observed) in self.spare.iter_mut().zip(&self.observed) {
            *light = observed - *light;
        }
        self.convolver.apply(&mut self.spare, &self.model.scatter);
        for (residual, scattered) in self.spare.iter_mut().zip(&self.scattered) {
            *residual -= scattered;
        }
        largest_modulus(self.spare.iter().copied())
    }

    /// Adds the residual to the scattered light, divided by `1 + H` where the plain step would not converge.
    fn step(&mut self) {
        if !self.is_plain() {
            self.convolver.apply(&mut self.spare, &self.model.inverse);
        }
        for (scattered, residual) in self.scattered.iter_mut().zip(&self.spare) {
            *scattered += residual;
        }
    }
}

/// Infinite as soon as one value is not finite.
fn largest_modulus(values: impl Iterator<Item = Complex<f32>>) -> f64 {
    let larger = |largest: f32, value: f32| if value.is_finite() { largest.max(value) } else { f32::INFINITY };
    f64::from(values.map(|value| value.norm_sqr()).fold(0.0, larger)).sqrt()
}

/// Zero for an image without any light.
fn relative(residual: f64, largest: f64) -> f64 {
    if residual > 0.0 { residual / largest } else { residual }
}
