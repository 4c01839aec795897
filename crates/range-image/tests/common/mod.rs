//! Raw samples of known phases.
#![allow(dead_code)]

use std::f64::consts::TAU;

use range_image::{Modulation, RawFrame, Samples};

/// Phase, amplitude and offset of one pixel at one frequency.
#[derive(Debug, Clone, Copy)]
pub struct Truth {
    pub phase: f64,
    pub amplitude: f64,
    pub offset: f64,
}

impl Truth {
    /// The sample at step `step` of `steps`, as the conventions write it.
    pub fn sample(&self, step: usize, steps: usize) -> f64 {
        self.offset + self.amplitude * (self.phase + TAU * step as f64 / steps as f64).cos()
    }
}

pub fn modulations(count: usize) -> Vec<Modulation> {
    [80e6, 60e6, 20e6].iter().take(count).map(|&f| Modulation::new(f).unwrap()).collect()
}

/// Samples `[F, N, pixels]` of a row of pixels for each frequency.
pub fn samples(truth: &[Vec<Truth>], steps: usize) -> Vec<f64> {
    let mut out = Vec::new();
    for channel in truth {
        for step in 0..steps {
            out.extend(channel.iter().map(|pixel| pixel.sample(step, steps)));
        }
    }
    out
}

pub fn frame_f32(truth: &[Vec<Truth>], steps: usize) -> RawFrame {
    let values = samples(truth, steps).iter().map(|&v| v as f32).collect();
    RawFrame::new(truth[0].len(), 1, steps, modulations(truth.len()), Samples::F32(values)).unwrap()
}

/// Difference of two angles in (-pi, pi].
pub fn angle_between(a: f64, b: f64) -> f64 {
    let turn = (a - b).rem_euclid(TAU);
    if turn > TAU / 2.0 { turn - TAU } else { turn }
}
