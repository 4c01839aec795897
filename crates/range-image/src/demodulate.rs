//! From raw samples to the complex image.

use rayon::prelude::*;

use crate::weights::StepWeight;
use crate::{ComplexChannel, ComplexFrame, DemodulationOptions, Flags, NoiseModel, Raster, RawFrame, Result, Samples};

/// Pixels worked on at a time: their sums stay in the first-level cache while the planes of samples pass by.
const BLOCK: usize = 1024;
/// Blocks that one task takes at least; smaller tasks cost more to hand out than to do.
const BLOCKS_PER_TASK: usize = 16;

/// Demodulates one frame; see [`Demodulator`] for streams of frames.
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
}

impl Demodulator {
    /// Checks the options.
    pub fn new(options: &DemodulationOptions) -> Result<Self> {
        options.validate()?;
        Ok(Self { options: options.clone() })
    }

    /// The options in use.
    pub fn options(&self) -> &DemodulationOptions {
        &self.options
    }

    /// Demodulates `frame` into `out`, whose planes are reused if they have the right size and allocated if not.
    ///
    /// The result does not depend on the number of threads, and everything that `out` held before is overwritten.
    pub fn demodulate_into(&self, frame: &RawFrame, out: &mut ComplexFrame) -> Result<()> {
        out.reshape(frame);
        out.flags.as_mut_slice().fill(Flags::empty());
        if out.flags.is_empty() {
            return Ok(());
        }
        let ComplexFrame { channels, flags } = out;
        let steps = frame.phase_steps();
        let job = ChannelJob { options: &self.options, noise: self.noise_of(frame.samples()), steps };
        let length = flags.len() * steps;
        for (index, channel) in channels.iter_mut().enumerate() {
            let own = index * length..(index + 1) * length;
            match frame.samples() {
                Samples::F32(samples) => job.run(&samples[own], channel, flags),
                Samples::U16(samples) => job.run(&samples[own], channel, flags),
                Samples::I16(samples) => job.run(&samples[own], channel, flags),
            }
        }
        Ok(())
    }

    fn noise_of(&self, samples: &Samples) -> NoiseModel {
        match samples {
            Samples::I16(_) => NoiseModel { shot_variance_per_unit: 0.0, ..self.options.noise },
            Samples::F32(_) | Samples::U16(_) => self.options.noise,
        }
    }
}

/// A sample of any of the types that sensors deliver; all are exact in f32.
trait Sample: Copy + Sync {
    fn value(self) -> f32;
}

impl Sample for f32 {
    fn value(self) -> f32 {
        self
    }
}

impl Sample for u16 {
    fn value(self) -> f32 {
        f32::from(self)
    }
}

impl Sample for i16 {
    fn value(self) -> f32 {
        f32::from(self)
    }
}

/// The demodulation of one frequency.
struct ChannelJob<'a> {
    options: &'a DemodulationOptions,
    noise: NoiseModel,
    steps: usize,
}

/// The planes of one block of pixels.
struct Block<'a> {
    re: &'a mut [f32],
    im: &'a mut [f32],
    mean: &'a mut [f32],
    sigma: &'a mut [f32],
    flags: &'a mut [Flags],
}

impl ChannelJob<'_> {
    fn run<S: Sample>(&self, samples: &[S], channel: &mut ComplexChannel, flags: &mut Raster<Flags>) {
        let Some(offset) = channel.offset.as_mut() else { return };
        let pixels = flags.len();
        channel
            .real
            .as_mut_slice()
            .par_chunks_mut(BLOCK)
            .zip(channel.imaginary.as_mut_slice().par_chunks_mut(BLOCK))
            .zip(offset.as_mut_slice().par_chunks_mut(BLOCK))
            .zip(channel.sigma.as_mut_slice().par_chunks_mut(BLOCK))
            .zip(flags.as_mut_slice().par_chunks_mut(BLOCK))
            .with_min_len(BLOCKS_PER_TASK)
            .enumerate()
            .for_each(|(index, ((((re, im), mean), sigma), flags))| {
                let mut block = Block { re, im, mean, sigma, flags };
                let start = index * BLOCK;
                let plane = |step: usize| &samples[step * pixels + start..][..block_len(start, pixels)];
                self.accumulate(plane, &mut block);
                self.flag_saturation(plane, &mut block);
                self.finish(&mut block);
            });
    }

    /// Adds up real part, imaginary part and mean, plane by plane.
    fn accumulate<'s, S: Sample + 's>(&self, plane: impl Fn(usize) -> &'s [S], block: &mut Block) {
        block.re.fill(0.0);
        block.im.fill(0.0);
        block.mean.fill(0.0);
        for step in 0..self.steps {
            let weight = StepWeight::new(step, self.steps, self.options);
            let sums = block.re.iter_mut().zip(block.im.iter_mut()).zip(block.mean.iter_mut());
            for (sample, ((re, im), mean)) in plane(step).iter().zip(sums) {
                let value = sample.value();
                *re += weight.re * value;
                *im += weight.im * value;
                *mean += weight.mean * value;
            }
        }
    }

    fn flag_saturation<'s, S: Sample + 's>(&self, plane: impl Fn(usize) -> &'s [S], block: &mut Block) {
        let Some(saturation) = self.options.saturation else { return };
        let limit = saturation as f32;
        for step in 0..self.steps {
            for (sample, flags) in plane(step).iter().zip(block.flags.iter_mut()) {
                let reached = if sample.value().abs() >= limit { Flags::SATURATED.bits() } else { 0 };
                *flags = Flags::from_bits_retain(flags.bits() | reached);
            }
        }
    }

    /// Sigma, low amplitude and pixels without data, from the sums.
    fn finish(&self, block: &mut Block) {
        let scale = 2.0 / self.steps as f64;
        let unknown = if self.noise.is_known() { 0.0 } else { f32::NAN };
        let shot = (scale * self.noise.shot_variance_per_unit) as f32;
        let dark = (scale * self.noise.dark_sigma * self.noise.dark_sigma) as f32 + unknown;
        let low = self.options.low_amplitude.unwrap_or(0.0) as f32;
        let parts = block.re.iter_mut().zip(block.im.iter_mut()).zip(block.mean.iter_mut());
        let rest = block.sigma.iter_mut().zip(block.flags.iter_mut());
        for (((re, im), mean), (sigma, flags)) in parts.zip(rest) {
            let finite = re.is_finite() & im.is_finite() & mean.is_finite();
            let keep = if finite { 0.0 } else { f32::NAN };
            *sigma = (shot * mean.max(0.0) + dark + keep).sqrt();
            let dim = crate::polar::modulus(*re, *im) < low;
            *re += keep;
            *im += keep;
            *mean += keep;
            let bits = if finite { 0 } else { Flags::NO_DATA.bits() }
                | if dim & finite { Flags::LOW_AMPLITUDE.bits() } else { 0 };
            *flags = Flags::from_bits_retain(flags.bits() | bits);
        }
    }
}

fn block_len(start: usize, pixels: usize) -> usize {
    BLOCK.min(pixels - start)
}
