//! Harmonics of the modulation as images, from more than four samples.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use rayon::prelude::*;

use crate::demodulation::samples::{Sample, SampleBlock, Sums};
use crate::demodulation::weights::{GROUP, StepWeight, StepWeights};
use crate::rasters::wide::{Arithmetic, PixelLoop, run_wide, task_length};
use crate::{ComplexChannel, DemodulationOptions, Error, Raster, RawFrame, Result, Samples};

/// The complex image `z_m = A_m exp(i (m phi + psi_m))` of the m-th harmonic at one frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct HarmonicImage {
    /// Order m; 1 would be the fundamental.
    pub order: usize,
    /// Real part, in the samples' unit; NaN where there is no value.
    pub real: Raster<f32>,
    /// Imaginary part, in the samples' unit; NaN where there is no value.
    pub imaginary: Raster<f32>,
}

/// What a harmonic is to the fundamental: samples are `B + A (cos phi_n + r cos(m phi_n + psi) + ..)` with
/// `phi_n = phi + theta_n`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct HarmonicRatio {
    /// Order m, from 2 on.
    pub order: usize,
    /// Amplitude r of the harmonic for each unit of the fundamental's.
    pub ratio: f64,
    /// Phase psi in radian, in the sense of the conventions.
    pub phase_rad: f64,
}

/// The harmonics of orders 2 to `floor((N - 1) / 2)`, for each frequency of the frame.
///
/// `z_m = 2/N sum_n S_n exp(-i m theta_n)`, in the sense of the options' convention. An image of order m also holds all
/// harmonics of orders `k N - m` and `k N + m`. Fails with fewer than five samples, which show no harmonic.
pub fn harmonics(frame: &RawFrame, options: &DemodulationOptions) -> Result<Vec<Vec<HarmonicImage>>> {
    options.validate()?;
    let steps = frame.phase_steps();
    if steps < 5 {
        let expected = "a second harmonic beside the fundamental needs at least 5 phase steps";
        return Err(Error::OutOfDomain { name: "phase_steps", value: steps as f64, expected });
    }
    let length = frame.width() * frame.height() * steps;
    let orders = 2..=(steps - 1) / 2;
    let of_frequency = |index: usize| {
        let own = index * length..(index + 1) * length;
        let image = |order| match frame.samples() {
            Samples::F32(samples) => image(order, &samples[own.clone()], frame, options),
            Samples::U16(samples) => image(order, &samples[own.clone()], frame, options),
            Samples::I16(samples) => image(order, &samples[own.clone()], frame, options),
        };
        orders.clone().map(image).collect()
    };
    Ok((0..frame.modulations().len()).map(of_frequency).collect())
}

fn image<S: Sample>(order: usize, samples: &[S], frame: &RawFrame, options: &DemodulationOptions) -> HarmonicImage {
    let weights = StepWeights::of_harmonic(order, frame.phase_steps(), options);
    let mut real = Raster::filled(frame.width(), frame.height(), f32::NAN);
    let mut imaginary = real.clone();
    let pixels = real.len();
    let length = task_length(pixels);
    let planes = real.as_mut_slice().par_chunks_mut(length).zip(imaginary.as_mut_slice().par_chunks_mut(length));
    planes.enumerate().for_each(|(index, (re, im))| {
        let block = SampleBlock { samples, steps: frame.phase_steps(), pixels, first: index * length };
        run_wide(re.len(), HarmonicLoop { block, weights: weights.groups(), re, im });
    });
    HarmonicImage { order, real, imaginary }
}

struct HarmonicLoop<'a, S> {
    block: SampleBlock<'a, S>,
    weights: &'a [[StepWeight; GROUP]],
    re: &'a mut [f32],
    im: &'a mut [f32],
}

impl<S: Sample> PixelLoop for HarmonicLoop<'_, S> {
    #[inline(always)]
    fn pixels<A: Arithmetic, const L: usize>(&mut self, start: usize) {
        let Some(sums) = Sums::<L>::of::<A, S>(&self.block, self.weights, start) else { return };
        let (Some(re), Some(im)) = (self.re[start..].first_chunk_mut::<L>(), self.im[start..].first_chunk_mut::<L>())
        else {
            return;
        };
        for lane in 0..L {
            let finite = sums.re[lane].is_finite() & sums.im[lane].is_finite();
            re[lane] = if finite { sums.re[lane] } else { f32::NAN };
            im[lane] = if finite { sums.im[lane] } else { f32::NAN };
        }
    }
}

/// Ratio of a harmonic to the fundamental over a whole image, by least squares: `sum z_m conj(u^m) A / sum A^2` with
/// `z = A u`. Pixels without a value are left out; fails where there is none.
///
/// It belongs to the waveforms of light and shutter, and not to the scene: a white wall that fills the image shows it
/// best. Light that comes by more than one way has another ratio.
pub fn harmonic_ratio(image: &HarmonicImage, fundamental: &ComplexChannel) -> Result<HarmonicRatio> {
    fundamental.validate()?;
    fundamental.real.require_same_size(&image.real, "real part of the harmonic")?;
    fundamental.real.require_same_size(&image.imaginary, "imaginary part of the harmonic")?;
    let parts = fundamental.real.as_slice().iter().zip(fundamental.imaginary.as_slice());
    let harmonic = image.real.as_slice().iter().zip(image.imaginary.as_slice());
    let (mut sums, mut power) = ([0.0; 2], 0.0);
    for ((x, y), (re, im)) in parts.zip(harmonic) {
        let [x, y, re, im] = [x, y, re, im].map(|value| f64::from(*value));
        if !(x + y + re + im).is_finite() {
            continue;
        }
        let amplitude = x.hypot(y);
        let (sin, cos) = (image.order as f64 * y.atan2(x)).sin_cos();
        sums[0] += amplitude * (re * cos + im * sin);
        sums[1] += amplitude * (im * cos - re * sin);
        power += amplitude * amplitude;
    }
    if power > 0.0 {
        let [re, im] = sums.map(|sum| sum / power);
        return Ok(HarmonicRatio { order: image.order, ratio: re.hypot(im), phase_rad: im.atan2(re) });
    }
    Err(Error::OutOfDomain { name: "amplitude", value: 0.0, expected: "at least one pixel has a value and light" })
}
