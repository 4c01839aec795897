//! From raw samples to the complex image.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use rayon::prelude::*;

use crate::demodulation::samples::{Sample, SampleBlock, Sums, peaks};
use crate::demodulation::weights::{GROUP, StepWeight, StepWeights};
use crate::rasters::wide::{Arithmetic, PixelLoop, run_wide, task_length};
use crate::{
    ComplexChannel, ComplexFrame, DemodulationOptions, Flags, NoiseModel, Raster, RawFrame, RawView, Result,
    SampleSlice,
};

/// Demodulates one frame; see [`Demodulator`] for streams of frames.
///
/// # Errors
/// What the options refuse, and a frame with fewer than three steps.
///
/// ```
/// use range_image::{DemodulationOptions, Modulation, RawFrame, Samples, demodulate};
///
/// // One pixel at 20 MHz in four steps, frequency by frequency, step by step, row by row: B = 500, A = 200, phi = 2 pi / 3.
/// let raw = RawFrame::new(1, 1, 4, vec![Modulation::new(20e6)?], Samples::U16(vec![400, 327, 600, 673]))?;
/// let frame = demodulate(&raw, &DemodulationOptions::default())?;
/// let channel = &frame.channels[0];
/// assert!((channel.phase()[(0, 0)] - 2.0944).abs() < 1e-3 && (channel.amplitude()[(0, 0)] - 200.0).abs() < 0.5);
/// # Ok::<(), range_image::Error>(())
/// ```
pub fn demodulate(frame: &RawFrame, options: &DemodulationOptions) -> Result<ComplexFrame> {
    let mut out = ComplexFrame::empty();
    Demodulator::new(options)?.demodulate_into(frame, &mut out)?;
    Ok(out)
}

/// Demodulation of frames into a frame that is used again and again.
///
/// `z = A exp(i phi) = 2/N sum_n S_n exp(-i theta_n)`, `theta_n = 2 pi n / N`, for any N >= 3 and any number of
/// frequencies; the sense and the offset of the phase and the scale are folded into the weights of the samples.
///
/// A pixel with a sample that is not finite gets `z`, offset and sigma NaN at that frequency, and [`Flags::NO_DATA`].
#[derive(Debug, Clone, PartialEq)]
pub struct Demodulator {
    options: DemodulationOptions,
    offset: bool,
}

impl Demodulator {
    /// Checks the options.
    pub fn new(options: &DemodulationOptions) -> Result<Self> {
        options.validate()?;
        Ok(Self { options: options.clone(), offset: true })
    }

    /// Frames get no offset plane, for those who do not look at it.
    #[must_use]
    pub fn without_offset(self) -> Self {
        Self { offset: false, ..self }
    }

    /// The options in use.
    pub fn options(&self) -> &DemodulationOptions {
        &self.options
    }

    /// Demodulates `frame` into `out`, whose planes are reused if they have the right size and allocated if not.
    ///
    /// The result does not depend on the number of threads, and everything that `out` held before is overwritten.
    pub fn demodulate_into(&self, frame: &RawFrame, out: &mut ComplexFrame) -> Result<()> {
        self.demodulate_view_into(&frame.view(), out)
    }

    /// As [`Self::demodulate_into`], of samples that are borrowed. Allocates nothing where the planes fit, up to 16 steps.
    pub fn demodulate_view_into(&self, frame: &RawView<'_>, out: &mut ComplexFrame) -> Result<()> {
        out.reshape(frame, self.offset);
        let ComplexFrame { channels, flags } = out;
        let weights = StepWeights::new(frame.phase_steps, &self.options);
        let job = ChannelJob { weights: weights.groups(), limits: self.limits(frame) };
        let length = flags.len() * frame.phase_steps;
        let mut kept = 0;
        for (index, channel) in channels.iter_mut().enumerate() {
            let own = index * length..(index + 1) * length;
            match frame.samples {
                SampleSlice::F32(samples) => job.run(&samples[own], channel, flags, kept),
                SampleSlice::U16(samples) => job.run(&samples[own], channel, flags, kept),
                SampleSlice::I16(samples) => job.run(&samples[own], channel, flags, kept),
            }
            kept = u16::MAX;
        }
        Ok(())
    }

    fn limits(&self, frame: &RawView<'_>) -> Limits {
        let noise = self.noise_of(frame.samples);
        let scale = 2.0 / frame.phase_steps as f64;
        let unknown = if noise.is_known() { 0.0 } else { f32::NAN };
        Limits {
            shot: (scale * noise.shot_variance_per_unit) as f32,
            dark: (scale * noise.dark_sigma * noise.dark_sigma) as f32 + unknown,
            // No number is at or above NaN.
            saturation: self.options.saturation.map_or(f32::NAN, |saturation| saturation as f32),
            inverse_low: self.options.low_amplitude.map_or(0.0, |low| (1.0 / low) as f32),
            low: if self.options.low_amplitude.is_some() { 1.0 } else { 0.0 },
        }
    }

    fn noise_of(&self, samples: SampleSlice<'_>) -> NoiseModel {
        match samples {
            SampleSlice::I16(_) => NoiseModel { shot_variance_per_unit: 0.0, ..self.options.noise },
            SampleSlice::F32(_) | SampleSlice::U16(_) => self.options.noise,
        }
    }
}

/// What sums of samples are judged by.
#[derive(Clone, Copy)]
struct Limits {
    /// Variance of each part of `z` for each unit of the offset.
    shot: f32,
    /// Variance of each part of `z` without light; NaN where nothing is known.
    dark: f32,
    saturation: f32,
    /// Amplitudes are compared in its unit, and squared: that needs no root.
    inverse_low: f32,
    low: f32,
}

/// The demodulation of one frequency.
struct ChannelJob<'a> {
    weights: &'a [[StepWeight; GROUP]],
    limits: Limits,
}

impl ChannelJob<'_> {
    /// Of the flags that the pixels have, those in `kept` stay.
    fn run<S: Sample>(&self, samples: &[S], channel: &mut ComplexChannel, flags: &mut Raster<Flags>, kept: u16) {
        let length = task_length(flags.len());
        if let Some(mut offset) = channel.offset.take() {
            let means = offset.as_mut_slice().par_chunks_mut(length).map(Some);
            self.run_with(samples, channel, flags, kept, means);
            channel.offset = Some(offset);
        } else {
            let none = (0..flags.len().div_ceil(length)).into_par_iter().map(|_| None);
            self.run_with(samples, channel, flags, kept, none);
        }
    }

    fn run_with<'m, S: Sample>(
        &self,
        samples: &[S],
        channel: &mut ComplexChannel,
        flags: &mut Raster<Flags>,
        kept: u16,
        means: impl IndexedParallelIterator<Item = Option<&'m mut [f32]>>,
    ) {
        let pixels = flags.len();
        let length = task_length(pixels);
        channel
            .real
            .as_mut_slice()
            .par_chunks_mut(length)
            .zip(channel.imaginary.as_mut_slice().par_chunks_mut(length))
            .zip(means)
            .zip(channel.sigma.as_mut_slice().par_chunks_mut(length))
            .zip(flags.as_mut_slice().par_chunks_mut(length))
            .enumerate()
            .for_each(|(index, ((((re, im), mean), sigma), flags))| {
                let block = SampleBlock { samples, steps: samples.len() / pixels, pixels, first: index * length };
                let (weights, limits) = (self.weights, self.limits);
                run_wide(re.len(), DemodulationLoop { block, weights, limits, kept, re, im, mean, sigma, flags });
            });
    }
}

/// The demodulation of one block of pixels.
struct DemodulationLoop<'a, S> {
    block: SampleBlock<'a, S>,
    weights: &'a [[StepWeight; GROUP]],
    limits: Limits,
    kept: u16,
    re: &'a mut [f32],
    im: &'a mut [f32],
    /// Where the offset is asked for.
    mean: Option<&'a mut [f32]>,
    sigma: &'a mut [f32],
    flags: &'a mut [Flags],
}

impl<S: Sample> PixelLoop for DemodulationLoop<'_, S> {
    #[inline(always)]
    fn pixels<A: Arithmetic, const L: usize>(&mut self, start: usize) {
        let Some(sums) = Sums::<L>::of::<A, S>(&self.block, self.weights, start) else { return };
        let mut peak = [0.0; L];
        for group in 0..self.weights.len() {
            let Some(planes) = self.block.group(group, start) else { return };
            peak = peaks(planes, peak);
        }
        let (Some(re), Some(im)) = (self.re[start..].first_chunk_mut::<L>(), self.im[start..].first_chunk_mut::<L>())
        else {
            return;
        };
        let Some(sigma) = self.sigma[start..].first_chunk_mut::<L>() else { return };
        let Some(flags) = self.flags[start..].first_chunk_mut::<L>() else { return };
        let Limits { shot, dark, saturation, inverse_low, low } = self.limits;
        let (mut found, mut keep) = ([0_u32; L], [0.0; L]);
        for lane in 0..L {
            let finite = sums.re[lane].is_finite() & sums.im[lane].is_finite() & sums.mean[lane].is_finite();
            keep[lane] = if finite { 0.0 } else { f32::NAN };
            let [x, y] = [sums.re[lane] * inverse_low, sums.im[lane] * inverse_low];
            let dim = A::multiply_add(x, x, y * y) < low;
            re[lane] = sums.re[lane] + keep[lane];
            im[lane] = sums.im[lane] + keep[lane];
            sigma[lane] = (A::multiply_add(shot, sums.mean[lane].max(0.0), dark) + keep[lane]).sqrt();
            found[lane] = if finite { 0 } else { u32::from(Flags::NO_DATA.bits()) }
                | if dim & finite { u32::from(Flags::LOW_AMPLITUDE.bits()) } else { 0 }
                | if peak[lane] >= saturation { u32::from(Flags::SATURATED.bits()) } else { 0 };
        }
        if let Some(mean) = self.mean.as_mut().and_then(|mean| mean[start..].first_chunk_mut::<L>()) {
            for lane in 0..L {
                mean[lane] = sums.mean[lane] + keep[lane];
            }
        }
        for lane in 0..L {
            flags[lane] = Flags::from_bits_retain((flags[lane].bits() & self.kept) | found[lane] as u16);
        }
    }
}
