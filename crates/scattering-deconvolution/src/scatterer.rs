use rustfft::num_complex::Complex;

use crate::convolution::{Convolver, Transfer, check_size};
use crate::spectrum::Spectrum;
use crate::{Error, Psf, Result};

/// Scatters light as a camera does: `z + psf * z`, linear convolution with nothing outside the image.
///
/// Made once for a size of image; all buffers are its own, so that applying it allocates nothing.
pub struct Scatterer {
    work: Option<(Convolver, Transfer)>,
    image: Vec<Complex<f32>>,
}

impl Scatterer {
    /// For images of `width` x `height` pixels.
    pub fn new(psf: &Psf, width: usize, height: usize) -> Result<Self> {
        check_size([width, height])?;
        let kernel = psf.sample([width - 1, height - 1])?;
        let convolver = Convolver::new([width, height], kernel.half_width)?;
        let image = vec![Complex::new(0.0, 0.0); width * height];
        if psf.is_empty() {
            return Ok(Self { work: None, image });
        }
        let transfer = Spectrum::of_kernel(&kernel, convolver.padded()).transfer();
        Ok(Self { work: Some((convolver, transfer)), image })
    }

    /// Adds the scattered light to the planes (row by row). A pixel that is not finite stays as it is and scatters nothing.
    pub fn apply(&mut self, real: &mut [f32], imaginary: &mut [f32]) -> Result<()> {
        for (what, plane) in [("real part", &*real), ("imaginary part", &*imaginary)] {
            if plane.len() != self.image.len() {
                return Err(Error::PlaneLength { what, expected: self.image.len(), found: plane.len() });
            }
        }
        let Some((convolver, transfer)) = &mut self.work else { return Ok(()) };
        for (value, (re, im)) in self.image.iter_mut().zip(real.iter().zip(imaginary.iter())) {
            let finite = re.is_finite() && im.is_finite();
            *value = if finite { Complex::new(*re, *im) } else { Complex::new(0.0, 0.0) };
        }
        convolver.apply(&mut self.image, transfer);
        for (scattered, (re, im)) in self.image.iter().zip(real.iter_mut().zip(imaginary.iter_mut())) {
            if re.is_finite() && im.is_finite() {
                *re += scattered.re;
                *im += scattered.im;
            }
        }
        Ok(())
    }
}
