//! The iteration that finds the scattered light.

use fourier_transforms::num_complex::Complex;

use crate::kernels::convolution::Convolver;
use crate::kernels::grid::Grid;
use crate::restoration::model::Model;
use crate::{Error, Psf, Refinement, RestorationOptions, Result};

/// Contraction up to which light is simply scattered again; beyond it each step is divided by `1 + H` as well.
const PLAIN_ITERATION: f64 = 0.5;

/// Buffers and operators of a point spread function that scatters something.
pub(crate) struct Work {
    pub(crate) model: Model,
    pub(crate) grid: Grid,
    pub(crate) convolver: Convolver,
    /// Observed light on the nodes.
    observed: Vec<Complex<f32>>,
    /// Scattered light on the nodes.
    pub(crate) scattered: Vec<Complex<f32>>,
    pub(crate) spare: Vec<Complex<f32>>,
    pub(crate) variance: [Vec<f32>; 2],
    pub(crate) kept_sigma: Vec<f32>,
}

impl Work {
    pub(crate) fn new(psf: &Psf, size: [usize; 2], options: &RestorationOptions) -> Result<Self> {
        let (model, grid, convolver) = Model::new(psf, size, options)?;
        let [columns, rows] = grid.size();
        let zeros = vec![Complex::new(0.0, 0.0); columns * rows];
        let (observed, scattered, spare) = (zeros.clone(), zeros.clone(), zeros);
        let variance = [Vec::new(), Vec::new()];
        Ok(Self { model, grid, convolver, observed, scattered, spare, variance, kept_sigma: Vec::new() })
    }

    /// Finds the scattered light; iterations made and bound of the residual relative to `largest`.
    pub(crate) fn solve(
        &mut self,
        real: &[f32],
        imaginary: &[f32],
        largest: f64,
        options: &RestorationOptions,
    ) -> Result<(usize, f64)> {
        self.grid.restrict(real, imaginary, &mut self.observed);
        self.scattered.copy_from_slice(&self.observed);
        match &self.model.estimate {
            Some(estimate) => self.convolver.apply(&mut self.scattered, estimate),
            None => self.model.scatter.apply(&mut self.convolver, &mut self.scattered),
        }
        let tolerance = options.tolerance;
        if options.refinement == Refinement::FilterOnly {
            let finite = largest_modulus(self.scattered.iter().copied()).is_finite();
            let failure = Error::NotConverged { iterations: 0, residual: f64::INFINITY, tolerance };
            return if finite { Ok((0, f64::NAN)) } else { Err(failure) };
        }
        let mut residual = f64::INFINITY;
        for iterations in 0..=options.max_iterations {
            residual = relative(self.find_residual(), largest);
            let bound = self.model.contraction * residual;
            if options.regularisation > 0.0 && residual.is_finite() {
                return Ok((iterations, residual));
            }
            if self.is_plain() && bound <= tolerance {
                self.step();
                return Ok((iterations + 1, bound));
            }
            if residual <= tolerance {
                return Ok((iterations, residual));
            }
            if !residual.is_finite() {
                break;
            }
            self.step();
        }
        Err(Error::NotConverged { iterations: options.max_iterations, residual, tolerance })
    }

    /// Takes the scattered light off the image.
    pub(crate) fn take_off(&mut self, real: &mut [f32], imaginary: &mut [f32]) {
        self.grid.add_interpolated(&self.scattered, -1.0, real, imaginary);
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
        self.model.scatter.apply(&mut self.convolver, &mut self.spare);
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
