//! From raw samples straight to phase and amplitude.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use rayon::prelude::*;

use crate::demodulation::samples::{Sample, SampleBlock, Sums};
use crate::demodulation::weights::{GROUP, StepWeight, StepWeights};
use crate::rasters::polar::{angle, modulus};
use crate::rasters::wide::{Arithmetic, PixelLoop, run_wide, task_length};
use crate::{Demodulator, Modulation, Raster, RawFrame, Samples};

/// Phase and amplitude of one frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct PolarChannel {
    /// Modulation this image was taken at.
    pub modulation: Modulation,
    /// Phase in `[0, 2 pi)`; NaN where there is no value.
    pub phase: Raster<f32>,
    /// Amplitude in the samples' unit; NaN where there is no value.
    pub amplitude: Raster<f32>,
}

impl PolarChannel {
    fn without_data(modulation: Modulation, width: usize, height: usize) -> Self {
        let plane = Raster::filled(width, height, f32::NAN);
        Self { modulation, phase: plane.clone(), amplitude: plane }
    }

    /// Takes modulation and size over; values are left as they are where the size fits.
    fn reshape(&mut self, modulation: Modulation, width: usize, height: usize) {
        let fits = |plane: &Raster<f32>| (plane.width(), plane.height()) == (width, height);
        if fits(&self.phase) && fits(&self.amplitude) {
            self.modulation = modulation;
        } else {
            *self = Self::without_data(modulation, width, height);
        }
    }
}

impl Demodulator {
    /// Writes phase and amplitude of each frequency into `out`, whose planes are reused if they have the right size.
    ///
    /// The way for viewers and for cameras without calibration: the same bits as [`Self::demodulate_into`] and then
    /// [`ComplexChannel::phase_and_amplitude_into`](crate::ComplexChannel::phase_and_amplitude_into) in about half
    /// of the time, because nothing in between is written to memory. There is neither offset nor sigma nor flag, and no
    /// `z` on which scattering could be undone; a pixel with a sample that is not finite is NaN.
    pub fn phase_and_amplitude_into(&self, frame: &RawFrame, out: &mut Vec<PolarChannel>) {
        let (width, height) = (frame.width(), frame.height());
        out.truncate(frame.modulations().len());
        let weights = StepWeights::new(frame.phase_steps(), self.options());
        let length = width * height * frame.phase_steps();
        for (index, &modulation) in frame.modulations().iter().enumerate() {
            if index == out.len() {
                out.push(PolarChannel::without_data(modulation, width, height));
            }
            let channel = &mut out[index];
            channel.reshape(modulation, width, height);
            let own = index * length..(index + 1) * length;
            match frame.samples() {
                Samples::F32(samples) => fill(&samples[own], weights.groups(), channel),
                Samples::U16(samples) => fill(&samples[own], weights.groups(), channel),
                Samples::I16(samples) => fill(&samples[own], weights.groups(), channel),
            }
        }
    }
}

fn fill<S: Sample>(samples: &[S], weights: &[[StepWeight; GROUP]], channel: &mut PolarChannel) {
    let (phase, amplitude) = (channel.phase.as_mut_slice(), channel.amplitude.as_mut_slice());
    let pixels = phase.len();
    let length = task_length(pixels);
    let planes = phase.par_chunks_mut(length).zip(amplitude.par_chunks_mut(length));
    planes.enumerate().for_each(|(index, (phase, amplitude))| {
        let block = SampleBlock { samples, steps: samples.len() / pixels, pixels, first: index * length };
        run_wide(phase.len(), SamplesToPolar { block, weights, phase, amplitude });
    });
}

struct SamplesToPolar<'a, S> {
    block: SampleBlock<'a, S>,
    weights: &'a [[StepWeight; GROUP]],
    phase: &'a mut [f32],
    amplitude: &'a mut [f32],
}

impl<S: Sample> PixelLoop for SamplesToPolar<'_, S> {
    #[inline(always)]
    fn pixels<A: Arithmetic, const L: usize>(&mut self, start: usize) {
        let Some(sums) = Sums::<L>::of::<A, S>(&self.block, self.weights, start) else { return };
        let (Some(phase), Some(amplitude)) =
            (self.phase[start..].first_chunk_mut::<L>(), self.amplitude[start..].first_chunk_mut::<L>())
        else {
            return;
        };
        for lane in 0..L {
            phase[lane] = angle::<A>(sums.re[lane], sums.im[lane]);
            amplitude[lane] = modulus::<A>(sums.re[lane], sums.im[lane]);
        }
    }
}
