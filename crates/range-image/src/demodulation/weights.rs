//! Weights of the samples in the sums of the demodulation.

use std::f64::consts::TAU;

use crate::{DemodulationOptions, PhaseSense};

/// Steps whose samples are added in one go.
pub(crate) const GROUP: usize = 4;

/// Groups whose weights need no memory of their own.
const FEW_GROUPS: usize = 4;

/// The weights of all steps in groups; the last group is filled up with zeros.
pub(crate) struct StepWeights {
    few: [[StepWeight; GROUP]; FEW_GROUPS],
    many: Vec<[StepWeight; GROUP]>,
    count: usize,
}

impl StepWeights {
    /// Those of the fundamental. Allocates only for more than 16 steps.
    pub(crate) fn new(steps: usize, options: &DemodulationOptions) -> Self {
        Self::of_harmonic(1, steps, options)
    }

    /// Those of a harmonic of any order.
    pub(crate) fn of_harmonic(order: usize, steps: usize, options: &DemodulationOptions) -> Self {
        let weight = |step| {
            if step < steps { StepWeight::new(step, steps, order, options) } else { StepWeight::default() }
        };
        let group = |index: usize| std::array::from_fn(|place| weight(index * GROUP + place));
        let count = steps.div_ceil(GROUP);
        let many = if count > FEW_GROUPS { (0..count).map(group).collect() } else { Vec::new() };
        Self { few: std::array::from_fn(group), many, count }
    }

    /// The groups in the order of their steps; there is at least one.
    pub(crate) fn groups(&self) -> &[[StepWeight; GROUP]] {
        if self.many.is_empty() { &self.few[..self.count] } else { &self.many }
    }
}

/// What one phase step contributes, per unit of its sample, to the real part, the imaginary part and the mean.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct StepWeight {
    pub re: f32,
    pub im: f32,
    pub mean: f32,
}

impl StepWeight {
    /// `2/N scale exp(-i m theta_n)`, conjugated for the negative sense, then turned by m times the phase offset.
    pub(crate) fn new(step: usize, steps: usize, order: usize, options: &DemodulationOptions) -> Self {
        let (sin, cos) = step_angle_sin_cos(step * order % steps, steps);
        let sin = match options.phase_sense {
            PhaseSense::Positive => -sin,
            PhaseSense::Negative => sin,
        };
        let (turn_sin, turn_cos) = (order as f64 * options.phase_offset_rad).sin_cos();
        let scale = options.raw_scale / steps as f64;
        Self {
            re: (2.0 * scale * (cos * turn_cos - sin * turn_sin)) as f32,
            im: (2.0 * scale * (sin * turn_cos + cos * turn_sin)) as f32,
            mean: scale as f32,
        }
    }
}

/// Sine and cosine of `2 pi step / steps`, exactly 0 and 1 in size at quarter turns, so that the four-step algorithm
/// stays the plain difference of two samples.
fn step_angle_sin_cos(step: usize, steps: usize) -> (f64, f64) {
    match (step * 4 % steps, step * 4 / steps) {
        (0, 0) => (0.0, 1.0),
        (0, 1) => (1.0, 0.0),
        (0, 2) => (0.0, -1.0),
        (0, 3) => (-1.0, 0.0),
        _ => (TAU * step as f64 / steps as f64).sin_cos(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_steps_are_plain_differences() {
        let weights: Vec<_> = (0..4).map(|n| StepWeight::new(n, 4, 1, &DemodulationOptions::default())).collect();
        let parts: Vec<_> = weights.iter().map(|w| [w.re, w.im, w.mean]).collect();
        let expected = [[0.5, 0.0, 0.25], [0.0, -0.5, 0.25], [-0.5, 0.0, 0.25], [0.0, 0.5, 0.25]];
        for (found, expected) in parts.iter().flatten().zip(expected.iter().flatten()) {
            // The products with sin 0 and cos 0 are exact, so no rounding can appear.
            assert!((found - expected).abs() < f32::MIN_POSITIVE);
        }
    }

    #[test]
    fn weights_of_a_full_turn_leave_no_offset() {
        for steps in 3..17 {
            let weights: Vec<_> =
                (0..steps).map(|n| StepWeight::new(n, steps, 1, &DemodulationOptions::default())).collect();
            let sum: f64 = weights.iter().map(|w| f64::from(w.re)).sum();
            // Each weight is at most 2/3 and rounded to f32: half a unit in the last place is 3e-8.
            assert!(sum.abs() < 3e-8 * steps as f64, "{steps} steps: {sum:e}");
        }
    }
}
