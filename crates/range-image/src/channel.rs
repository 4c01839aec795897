//! The complex image of one frequency.

use crate::polar::{angle, modulus};
use crate::{Modulation, Raster, Result};

/// The complex image `z = A exp(i phi)` of one frequency, as separate planes.
#[derive(Debug, Clone, PartialEq)]
pub struct ComplexChannel {
    /// Modulation this image was taken at.
    pub modulation: Modulation,
    /// Real part `A cos phi`, in the samples' unit.
    pub real: Raster<f32>,
    /// Imaginary part `A sin phi`, in the samples' unit.
    pub imaginary: Raster<f32>,
    /// Mean sample `B`, where samples were demodulated.
    pub offset: Option<Raster<f32>>,
    /// Standard deviation of each part of `z`, in the samples' unit; NaN where it is not known.
    pub sigma: Raster<f32>,
}

impl ComplexChannel {
    /// A channel of NaN with an offset plane.
    pub(crate) fn without_data(modulation: Modulation, width: usize, height: usize) -> Self {
        let plane = Raster::filled(width, height, f32::NAN);
        Self { modulation, real: plane.clone(), imaginary: plane.clone(), offset: Some(plane.clone()), sigma: plane }
    }

    /// Takes modulation and size over; values are left as they are where the size fits.
    pub(crate) fn reshape(&mut self, modulation: Modulation, width: usize, height: usize) {
        let fits = |plane: &Raster<f32>| (plane.width(), plane.height()) == (width, height);
        let offset_fits = self.offset.as_ref().is_some_and(fits);
        if offset_fits && fits(&self.real) && fits(&self.imaginary) && fits(&self.sigma) {
            self.modulation = modulation;
        } else {
            *self = Self::without_data(modulation, width, height);
        }
    }

    /// Fails unless all planes have the size of the real part.
    pub fn validate(&self) -> Result<()> {
        self.real.require_same_size(&self.imaginary, "imaginary part")?;
        self.real.require_same_size(&self.sigma, "sigma")?;
        self.offset.as_ref().map_or(Ok(()), |offset| self.real.require_same_size(offset, "offset"))
    }

    /// Amplitude `A = |z|`.
    pub fn amplitude(&self) -> Raster<f32> {
        self.evaluate(|re, im, _| modulus(re, im))
    }

    /// Phase in `[0, 2 pi)`, to 6e-7 rad.
    pub fn phase(&self) -> Raster<f32> {
        self.evaluate(|re, im, _| angle(re, im))
    }

    /// Standard deviation of the phase in radians, `sigma_z / A` (`[Lange2000]`).
    ///
    /// This holds where `A` is well above `sigma_z` (by 10 % at `A = 3 sigma_z`). It is never more than `pi / sqrt(3)`,
    /// that of a phase of which nothing is known. NaN where sigma is.
    pub fn sigma_phase(&self) -> Raster<f32> {
        self.evaluate(sigma_phase)
    }

    /// Standard deviation of the range in metres, `U / 2 pi * sigma_phase`; see [`Self::sigma_phase`].
    pub fn sigma_range(&self) -> Raster<f32> {
        let metres_per_radian = self.modulation.range_from_phase(1.0) as f32;
        self.evaluate(|re, im, sigma| metres_per_radian * sigma_phase(re, im, sigma))
    }

    /// Writes [`Self::amplitude`] into a plane that is there already.
    pub fn amplitude_into(&self, out: &mut Raster<f32>) -> Result<()> {
        self.evaluate_into(out, |re, im, _| modulus(re, im))
    }

    /// Writes [`Self::phase`] into a plane that is there already.
    pub fn phase_into(&self, out: &mut Raster<f32>) -> Result<()> {
        self.evaluate_into(out, |re, im, _| angle(re, im))
    }

    /// Writes [`Self::sigma_phase`] into a plane that is there already.
    pub fn sigma_phase_into(&self, out: &mut Raster<f32>) -> Result<()> {
        self.evaluate_into(out, sigma_phase)
    }

    fn evaluate(&self, value: impl Fn(f32, f32, f32) -> f32) -> Raster<f32> {
        let mut out = self.sigma.clone();
        self.fill(&mut out, value);
        out
    }

    fn evaluate_into(&self, out: &mut Raster<f32>, value: impl Fn(f32, f32, f32) -> f32) -> Result<()> {
        self.validate()?;
        self.real.require_same_size(out, "output plane")?;
        self.fill(out, value);
        Ok(())
    }

    fn fill(&self, out: &mut Raster<f32>, value: impl Fn(f32, f32, f32) -> f32) {
        let parts = self.real.as_slice().iter().zip(self.imaginary.as_slice()).zip(self.sigma.as_slice());
        for (out, ((re, im), sigma)) in out.as_mut_slice().iter_mut().zip(parts) {
            *out = value(*re, *im, *sigma);
        }
    }
}

fn sigma_phase(re: f32, im: f32, sigma_z: f32) -> f32 {
    /// `pi / sqrt(3)`: the standard deviation of an angle that is uniform over the circle.
    const UNIFORM: f32 = 1.813_799_4;
    let sigma = sigma_z / modulus(re, im);
    // Not `min`, which would turn NaN into the bound.
    if sigma > UNIFORM { UNIFORM } else { sigma }
}
