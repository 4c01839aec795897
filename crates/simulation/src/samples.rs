//! From the complex image to the sensor's samples: phase steps, noise, digitisation.

use std::f64::consts::TAU;

use rand_distr::{Distribution, StandardNormal};
use range_image::{NoiseModel, PhaseSense, RawFrame, Samples};
use rayon::prelude::*;

use crate::Result;
use crate::random::row_generator;
use crate::render::Image;
use crate::spec::SimulationSpec;
use crate::spec::errors::SampleType;

/// Takes one frame of the image. Its noise depends on the seed, the frame and the place in the frame only.
pub(crate) fn sample_frame(spec: &SimulationSpec, image: &Image, seed: u64, frame: usize) -> Result<RawFrame> {
    let format = spec.camera.geometry.format;
    let sampler = Sampler::new(spec, image, seed, frame);
    let count = image.channels.len() * spec.camera.phase_steps * format.width * format.height;
    let samples = match spec.errors.digitisation.map_or(SampleType::F32, |d| d.sample_type) {
        SampleType::F32 => Samples::F32(sampler.all(count, |value| value as f32)),
        // Values are between zero and the saturation, which fits.
        SampleType::U16 => Samples::U16(sampler.all(count, |value| value.round() as u16)),
    };
    let modulations = spec.camera.modulations()?;
    Ok(RawFrame::new(format.width, format.height, spec.camera.phase_steps, modulations, samples)?)
}

struct Sampler<'a> {
    image: &'a Image,
    width: usize,
    height: usize,
    steps: Vec<StepWeights>,
    noise: Option<NoiseModel>,
    raw_scale: f64,
    lowest: f64,
    highest: f64,
    seed: u64,
    frame: usize,
}

/// Weights of the two parts of `z` in the sample of one phase step.
#[derive(Clone, Copy)]
struct StepWeights {
    real: f64,
    imaginary: f64,
}

impl StepWeights {
    /// The camera's own phase is `psi = +-(phi - offset)`, and its sample `B + A cos(psi + theta)`: the inverse of
    /// demodulation, where `phi = +-psi + offset`.
    fn new(step: usize, spec: &SimulationSpec) -> Self {
        let theta = TAU * step as f64 / spec.camera.phase_steps as f64;
        let turn = match spec.camera.phase_sense {
            PhaseSense::Positive => theta - spec.camera.phase_offset_rad,
            PhaseSense::Negative => -theta - spec.camera.phase_offset_rad,
        };
        Self { real: turn.cos(), imaginary: -turn.sin() }
    }
}

impl<'a> Sampler<'a> {
    fn new(spec: &SimulationSpec, image: &'a Image, seed: u64, frame: usize) -> Self {
        let digitisation = spec.errors.digitisation;
        let whole = digitisation.is_some_and(|d| d.sample_type == SampleType::U16);
        Self {
            image,
            width: spec.camera.geometry.format.width,
            height: spec.camera.geometry.format.height,
            steps: (0..spec.camera.phase_steps).map(|step| StepWeights::new(step, spec)).collect(),
            noise: spec.errors.noise,
            raw_scale: digitisation.map_or(1.0, |d| d.raw_scale),
            lowest: if whole { 0.0 } else { f64::NEG_INFINITY },
            highest: digitisation.and_then(|d| d.highest()).unwrap_or(f64::INFINITY),
            seed,
            frame,
        }
    }

    /// All samples in `[F, N, H, W]` order, a row of one plane at a time.
    fn all<T: Copy + Default + Send>(&self, count: usize, store: impl Fn(f64) -> T + Sync) -> Vec<T> {
        let mut samples = vec![T::default(); count];
        samples.par_chunks_mut(self.width).enumerate().for_each(|(index, row)| self.row(index, row, &store));
        samples
    }

    fn row<T>(&self, index: usize, samples: &mut [T], store: impl Fn(f64) -> T) {
        let (plane, row) = (index / self.height, index % self.height);
        let (channel, step) = (plane / self.steps.len(), plane % self.steps.len());
        let [real, imaginary] = &self.image.channels[channel];
        let weights = self.steps[step];
        let mut generator = row_generator(self.seed, self.frame, index);
        for (col, sample) in samples.iter_mut().enumerate() {
            let pixel = row * self.width + col;
            let modulated = weights.real * f64::from(real[pixel]) + weights.imaginary * f64::from(imaginary[pixel]);
            let clean = f64::from(self.image.offset[pixel]) + modulated;
            let noisy = self.noise.map_or(clean, |noise| {
                let unit: f64 = StandardNormal.sample(&mut generator);
                clean + unit * standard_deviation(&noise, clean)
            });
            *sample = store((noisy / self.raw_scale).clamp(self.lowest, self.highest));
        }
    }
}

fn standard_deviation(noise: &NoiseModel, sample: f64) -> f64 {
    (noise.shot_variance_per_unit * sample.max(0.0) + noise.dark_sigma * noise.dark_sigma).sqrt()
}
