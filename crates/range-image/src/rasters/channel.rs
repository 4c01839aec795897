//! The complex image of one frequency.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use rayon::prelude::*;

use crate::rasters::polar::{angle, modulus};
use crate::rasters::wide::{Arithmetic, PixelLoop, run_wide, task_length};
use crate::{Error, Modulation, Raster, Result};

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

/// Some pixels of a complex image.
#[derive(Debug, Clone, Copy)]
pub struct ComplexPixels<'a> {
    /// Real part.
    pub real: &'a [f32],
    /// Imaginary part.
    pub imaginary: &'a [f32],
    /// Standard deviation of each part.
    pub sigma: &'a [f32],
}

/// What is derived of them.
#[derive(Debug)]
pub struct PolarPixels<'a> {
    /// As [`ComplexChannel::phase`].
    pub phase: &'a mut [f32],
    /// As [`ComplexChannel::amplitude`].
    pub amplitude: &'a mut [f32],
    /// As [`ComplexChannel::sigma_phase`], times a unit.
    pub sigma: &'a mut [f32],
}

impl ComplexChannel {
    /// A channel of NaN, with an offset plane or without.
    pub(crate) fn without_data(modulation: Modulation, [width, height]: [usize; 2], offset: bool) -> Self {
        let plane = Raster::filled(width, height, f32::NAN);
        let offset = offset.then(|| plane.clone());
        Self { modulation, real: plane.clone(), imaginary: plane.clone(), offset, sigma: plane }
    }

    /// Takes modulation and size over; values are left as they are where the size fits.
    pub(crate) fn reshape(&mut self, modulation: Modulation, size: [usize; 2], offset: bool) {
        let fits = |plane: &Raster<f32>| [plane.width(), plane.height()] == size;
        let offset_fits = self.offset.as_ref().map_or(!offset, |plane| offset && fits(plane));
        if offset_fits && fits(&self.real) && fits(&self.imaginary) && fits(&self.sigma) {
            self.modulation = modulation;
        } else {
            *self = Self::without_data(modulation, size, offset);
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
        self.evaluate(Amplitude)
    }

    /// Phase in `[0, 2 pi)`, to 6e-7 rad.
    pub fn phase(&self) -> Raster<f32> {
        self.evaluate(Phase)
    }

    /// Standard deviation of the phase in radians, `sigma_z / A` (`[Lange2000]`).
    ///
    /// This holds where `A` is well above `sigma_z` (by 10 % at `A = 3 sigma_z`). It is never more than `pi / sqrt(3)`,
    /// that of a phase of which nothing is known. NaN where sigma is.
    pub fn sigma_phase(&self) -> Raster<f32> {
        self.evaluate(SigmaPhase { unit: 1.0 })
    }

    /// Standard deviation of the range in metres, `U / 2 pi * sigma_phase`; see [`Self::sigma_phase`].
    pub fn sigma_range(&self) -> Raster<f32> {
        self.evaluate(SigmaPhase { unit: self.modulation.range_from_phase(1.0) as f32 })
    }

    /// Writes [`Self::amplitude`] into a plane that is there already.
    pub fn amplitude_into(&self, out: &mut Raster<f32>) -> Result<()> {
        self.evaluate_into(Amplitude, out)
    }

    /// Writes [`Self::phase`] into a plane that is there already.
    pub fn phase_into(&self, out: &mut Raster<f32>) -> Result<()> {
        self.evaluate_into(Phase, out)
    }

    /// Writes [`Self::sigma_phase`] into a plane that is there already.
    pub fn sigma_phase_into(&self, out: &mut Raster<f32>) -> Result<()> {
        self.evaluate_into(SigmaPhase { unit: 1.0 }, out)
    }

    /// Writes [`Self::sigma_range`] into a plane that is there already.
    pub fn sigma_range_into(&self, out: &mut Raster<f32>) -> Result<()> {
        self.evaluate_into(SigmaPhase { unit: self.modulation.range_from_phase(1.0) as f32 }, out)
    }

    /// Writes [`Self::phase`] and [`Self::amplitude`] into planes that are there already, with one look at `z`.
    ///
    /// See [`Demodulator::phase_and_amplitude_into`](crate::Demodulator::phase_and_amplitude_into) for the way that
    /// does without `z`.
    pub fn phase_and_amplitude_into(&self, phase: &mut Raster<f32>, amplitude: &mut Raster<f32>) -> Result<()> {
        self.validate()?;
        self.real.require_same_size(phase, "phase plane")?;
        self.real.require_same_size(amplitude, "amplitude plane")?;
        let (phase, amplitude) = (phase.as_mut_slice(), amplitude.as_mut_slice());
        let length = task_length(phase.len());
        let parts = self.real.as_slice().par_chunks(length).zip(self.imaginary.as_slice().par_chunks(length));
        let planes = phase.par_chunks_mut(length).zip(amplitude.par_chunks_mut(length));
        planes.zip(parts).for_each(|((phase, amplitude), (re, im))| {
            run_wide(re.len(), PolarLoop { re, im, phase, amplitude });
        });
        Ok(())
    }

    /// Writes [`Self::phase`], [`Self::amplitude`] and [`Self::sigma_phase`] times `unit` into planes that are there already, with
    /// one look at `z`. The `unit` of [`Self::sigma_range`] is that of the modulation,
    /// `range_from_phase(1.0)` in single precision.
    pub fn phase_amplitude_and_sigma_into(
        &self,
        phase: &mut Raster<f32>,
        amplitude: &mut Raster<f32>,
        sigma: &mut Raster<f32>,
        unit: f32,
    ) -> Result<()> {
        self.validate()?;
        self.real.require_same_size(phase, "phase plane")?;
        self.real.require_same_size(amplitude, "amplitude plane")?;
        self.real.require_same_size(sigma, "sigma plane")?;
        let length = task_length(phase.len());
        let parts = self.real.as_slice().par_chunks(length).zip(self.imaginary.as_slice().par_chunks(length));
        let parts = parts.zip(self.sigma.as_slice().par_chunks(length));
        let planes = phase.as_mut_slice().par_chunks_mut(length).zip(amplitude.as_mut_slice().par_chunks_mut(length));
        let planes = planes.zip(sigma.as_mut_slice().par_chunks_mut(length));
        planes.zip(parts).for_each(|(((phase, amplitude), sigma), ((re, im), given))| {
            run_wide(re.len(), PolarSigmaLoop { polar: PolarLoop { re, im, phase, amplitude }, given, sigma, unit });
        });
        Ok(())
    }

    fn evaluate(&self, value: impl PixelValue) -> Raster<f32> {
        let mut out = self.sigma.clone();
        self.fill(value, &mut out);
        out
    }

    fn evaluate_into(&self, value: impl PixelValue, out: &mut Raster<f32>) -> Result<()> {
        self.validate()?;
        self.real.require_same_size(out, "output plane")?;
        self.fill(value, out);
        Ok(())
    }

    fn fill(&self, value: impl PixelValue, out: &mut Raster<f32>) {
        let out = out.as_mut_slice();
        let length = task_length(out.len());
        let parts = self.real.as_slice().par_chunks(length).zip(self.imaginary.as_slice().par_chunks(length));
        let parts = parts.zip(self.sigma.as_slice().par_chunks(length));
        out.par_chunks_mut(length).zip(parts).for_each(|(out, ((re, im), sigma))| {
            run_wide(re.len(), PlaneLoop { value, re, im, sigma, out });
        });
    }
}

impl ComplexPixels<'_> {
    /// As [`ComplexChannel::phase_amplitude_and_sigma_into`].
    ///
    /// Fails where the slices differ in length.
    pub fn phase_amplitude_and_sigma_into(self, out: PolarPixels<'_>, unit: f32) -> Result<()> {
        let Self { real: re, imaginary: im, sigma: given } = self;
        let PolarPixels { phase, amplitude, sigma } = out;
        let count = phase.len();
        let lengths = [re.len(), im.len(), given.len(), amplitude.len(), sigma.len()];
        if let Some(found) = lengths.into_iter().find(|found| *found != count) {
            return Err(Error::RasterLength { width: count, height: 1, expected: count, found });
        }
        run_wide(count, PolarSigmaLoop { polar: PolarLoop { re, im, phase, amplitude }, given, sigma, unit });
        Ok(())
    }
}

/// What one pixel of a derived plane is.
trait PixelValue: Copy + Sync {
    fn of<A: Arithmetic>(self, re: f32, im: f32, sigma: f32) -> f32;
}

#[derive(Clone, Copy)]
struct Amplitude;

#[derive(Clone, Copy)]
struct Phase;

/// Deviation of the phase in units of `1 / unit` radian.
#[derive(Clone, Copy)]
struct SigmaPhase {
    unit: f32,
}

impl PixelValue for Amplitude {
    #[inline(always)]
    fn of<A: Arithmetic>(self, re: f32, im: f32, _: f32) -> f32 {
        modulus::<A>(re, im)
    }
}

impl PixelValue for Phase {
    #[inline(always)]
    fn of<A: Arithmetic>(self, re: f32, im: f32, _: f32) -> f32 {
        angle::<A>(re, im)
    }
}

impl PixelValue for SigmaPhase {
    #[inline(always)]
    fn of<A: Arithmetic>(self, re: f32, im: f32, sigma_z: f32) -> f32 {
        self.at(modulus::<A>(re, im), sigma_z)
    }
}

impl SigmaPhase {
    #[inline(always)]
    fn at(self, amplitude: f32, sigma_z: f32) -> f32 {
        /// `pi / sqrt(3)`: the standard deviation of an angle that is uniform over the circle.
        const UNIFORM: f32 = 1.813_799_4;
        let sigma = sigma_z / amplitude;
        // Not `min`, which would turn NaN into the bound.
        self.unit * if sigma > UNIFORM { UNIFORM } else { sigma }
    }
}

/// One derived plane.
struct PlaneLoop<'a, V> {
    value: V,
    re: &'a [f32],
    im: &'a [f32],
    sigma: &'a [f32],
    out: &'a mut [f32],
}

impl<V: PixelValue> PixelLoop for PlaneLoop<'_, V> {
    #[inline(always)]
    fn pixels<A: Arithmetic, const L: usize>(&mut self, start: usize) {
        let (Some(re), Some(im)) = (self.re[start..].first_chunk::<L>(), self.im[start..].first_chunk::<L>()) else {
            return;
        };
        let (Some(sigma), Some(out)) =
            (self.sigma[start..].first_chunk::<L>(), self.out[start..].first_chunk_mut::<L>())
        else {
            return;
        };
        for lane in 0..L {
            out[lane] = self.value.of::<A>(re[lane], im[lane], sigma[lane]);
        }
    }
}

/// Phase and amplitude together.
struct PolarLoop<'a> {
    re: &'a [f32],
    im: &'a [f32],
    phase: &'a mut [f32],
    amplitude: &'a mut [f32],
}

impl PixelLoop for PolarLoop<'_> {
    #[inline(always)]
    fn pixels<A: Arithmetic, const L: usize>(&mut self, start: usize) {
        let (Some(re), Some(im)) = (self.re[start..].first_chunk::<L>(), self.im[start..].first_chunk::<L>()) else {
            return;
        };
        let (Some(phase), Some(amplitude)) =
            (self.phase[start..].first_chunk_mut::<L>(), self.amplitude[start..].first_chunk_mut::<L>())
        else {
            return;
        };
        for lane in 0..L {
            phase[lane] = angle::<A>(re[lane], im[lane]);
            amplitude[lane] = modulus::<A>(re[lane], im[lane]);
        }
    }
}

/// Phase and amplitude, and what follows of the noise.
struct PolarSigmaLoop<'a> {
    polar: PolarLoop<'a>,
    /// Deviation of each part of `z`.
    given: &'a [f32],
    sigma: &'a mut [f32],
    unit: f32,
}

impl PixelLoop for PolarSigmaLoop<'_> {
    #[inline(always)]
    fn pixels<A: Arithmetic, const L: usize>(&mut self, start: usize) {
        self.polar.pixels::<A, L>(start);
        let (Some(amplitude), Some(given)) =
            (self.polar.amplitude[start..].first_chunk::<L>(), self.given[start..].first_chunk::<L>())
        else {
            return;
        };
        let Some(sigma) = self.sigma[start..].first_chunk_mut::<L>() else { return };
        let value = SigmaPhase { unit: self.unit };
        for lane in 0..L {
            sigma[lane] = value.at(amplitude[lane], given[lane]);
        }
    }
}
