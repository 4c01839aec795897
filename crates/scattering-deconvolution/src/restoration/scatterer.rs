use fourier_transforms::num_complex::Complex;

use crate::kernels::convolution::{Convolver, check_size};
use crate::kernels::grid::Grid;
use crate::kernels::operator::Operator;
use crate::kernels::parts::parts;
use crate::restoration::model::{Scattering, operator};
use crate::{Error, Psf, Result};

/// Scatters light as a camera does: `z + psf * z`, linear convolution with nothing outside the image.
///
/// Made once for a size of image; all buffers are its own, so that applying it allocates nothing. Ghosts that are late by
/// a way in metres have a phase only at one modulation: give `psf.at_modulation(..)`, and `psf.without_phases()` for the
/// mean of the samples.
pub struct Scatterer {
    work: Option<(Convolver, Operator)>,
    image: Vec<Complex<f32>>,
}

impl Scatterer {
    /// For images of `width` x `height` pixels.
    ///
    /// # Errors
    /// What [`Psf::validate`] finds, images that are too large, ghosts without a phase.
    pub fn new(psf: &Psf, width: usize, height: usize) -> Result<Self> {
        let size = [width, height];
        check_size(size)?;
        let parts = parts(psf, size)?;
        let image = vec![Complex::new(0.0, 0.0); width * height];
        if parts.is_empty() {
            return Ok(Self { work: None, image });
        }
        let grid = Grid::new(size, [1, 1]);
        let Scattering { convolver, spectra, .. } = Scattering::new(&parts, &grid)?;
        Ok(Self { work: Some((convolver, operator(&parts, &spectra, &grid))), image })
    }

    /// Adds the scattered light to the planes (row by row). A pixel that is not finite stays as it is and scatters nothing.
    pub fn apply(&mut self, real: &mut [f32], imaginary: &mut [f32]) -> Result<()> {
        for (what, plane) in [("real part", &*real), ("imaginary part", &*imaginary)] {
            if plane.len() != self.image.len() {
                return Err(Error::PlaneLength { what, expected: self.image.len(), found: plane.len() });
            }
        }
        let Some((convolver, operator)) = &mut self.work else { return Ok(()) };
        for (value, (re, im)) in self.image.iter_mut().zip(real.iter().zip(imaginary.iter())) {
            let finite = re.is_finite() && im.is_finite();
            *value = if finite { Complex::new(*re, *im) } else { Complex::new(0.0, 0.0) };
        }
        operator.apply(convolver, &mut self.image);
        for (scattered, (re, im)) in self.image.iter().zip(real.iter_mut().zip(imaginary.iter_mut())) {
            if re.is_finite() && im.is_finite() {
                *re += scattered.re;
                *im += scattered.im;
            }
        }
        Ok(())
    }
}
