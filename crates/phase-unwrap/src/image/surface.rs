//! What a pair of neighbouring pixels says about the surface between them.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use range_image::with_wide_registers;
use statistics::{CHI_MEDIANS, upper_median};

use crate::image::cuts::gentler;
use crate::image::logarithm::logarithm;
use crate::tree::grid::{Grid, wrapped};

/// Largest phase variance used, rad^2: beyond it a phase says nothing anyway.
const MAXIMUM_VARIANCE: f32 = 10.0;

/// Padded planes of phase and amplitude. Masked pixels have a NaN phase.
#[derive(Debug, Default)]
pub(crate) struct Surface {
    pub phase: Vec<f32>,
    /// Natural logarithm of the amplitude; NaN where unknown.
    pub log_amplitude: Vec<f32>,
    /// Variance of the phase, rad^2.
    pub variance: Vec<f32>,
    /// Noise that the variances of the last amplitudes came from.
    pub amplitude_noise: f32,
    sample: Vec<f32>,
}

/// The step between two neighbours.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step {
    /// Wrapped phase step beyond the slope around it, rad, not negative.
    pub phase: f32,
    /// Logarithm of the amplitude ratio, not negative; NaN where an amplitude is unknown.
    pub amplitude: f32,
}

impl Surface {
    /// Takes the user's standard deviations of the phase, rad, as a padded plane; what is not finite or negative says
    /// nothing about the phase.
    pub fn set_sigma(&mut self, sigma: &[f32]) {
        self.variance.clear();
        self.variance.extend(sigma.iter().map(|&sigma| {
            let known = sigma >= 0.0 && sigma.is_finite();
            if known { (sigma * sigma).min(MAXIMUM_VARIANCE) } else { MAXIMUM_VARIANCE }
        }));
    }

    /// Fills logarithm and variance from the padded amplitude; `noise` is the standard deviation in amplitude units.
    pub fn set_amplitude(&mut self, grid: &Grid, amplitude: &[f32], noise: Option<f32>) {
        let noise = noise.unwrap_or_else(|| self.estimate_noise(grid, amplitude));
        self.amplitude_noise = noise;
        self.log_amplitude.resize(amplitude.len(), 0.0);
        self.variance.resize(amplitude.len(), 0.0);
        let (logs, variances) = (&mut self.log_amplitude, &mut self.variance);
        with_wide_registers(
            #[inline(always)]
            || {
                for ((log, variance), &a) in logs.iter_mut().zip(variances.iter_mut()).zip(amplitude) {
                    let value = logarithm(a);
                    *log = if a > 0.0 && a < f32::INFINITY { value } else { f32::NAN };
                    let sigma = noise / a;
                    let known = if a > 0.0 { (sigma * sigma).min(MAXIMUM_VARIANCE) } else { MAXIMUM_VARIANCE };
                    // An amplitude that is not known leaves the noise to the second differences alone.
                    *variance = if a.is_nan() { 0.0 } else { known };
                }
            },
        );
    }

    /// Whether any used pixel has an amplitude.
    pub fn has_amplitude(&self) -> bool {
        self.phase.iter().zip(&self.log_amplitude).any(|(phase, log)| !phase.is_nan() && !log.is_nan())
    }

    /// Noise of each part of the complex image: the median of |second difference| * amplitude over the rows.
    ///
    /// Jumps and creases are few, so the median is that of the noise; at unit variance it is √6 times that of a normal modulus.
    fn estimate_noise(&mut self, grid: &Grid, amplitude: &[f32]) -> f32 {
        const SAMPLES: usize = 4096;
        let inner = grid.inner();
        let stride = (inner.len() / SAMPLES).max(1);
        self.sample.clear();
        for pixel in inner.step_by(stride) {
            let [left, centre, right] = [self.phase[pixel - 1], self.phase[pixel], self.phase[pixel + 1]];
            let scatter = (wrapped(left - centre) + wrapped(right - centre)).abs() * amplitude[pixel];
            if scatter.is_finite() {
                self.sample.push(scatter);
            }
        }
        if self.sample.is_empty() {
            return 0.0;
        }
        upper_median(&mut self.sample) / (CHI_MEDIANS[0] as f32 * 6.0_f32.sqrt())
    }

    /// The step from `pixel` to its neighbour `other`, both inside the image, along the axis of index step `ahead`.
    #[inline(always)]
    pub fn step(&self, pixel: usize, other: usize, ahead: usize) -> Step {
        let along = |from: usize| wrapped(self.phase[from + ahead] - self.phase[from]);
        let here = wrapped(self.phase[other] - self.phase[pixel]);
        let slope = gentler(along(pixel - ahead), along(other));
        Step { phase: (here - slope).abs(), amplitude: (self.log_amplitude[other] - self.log_amplitude[pixel]).abs() }
    }

    /// Standard deviation of the phase step from `pixel` to `other`, rad.
    pub fn sigma(&self, pixel: usize, other: usize) -> f32 {
        (self.variance[pixel] + self.variance[other]).sqrt()
    }

    /// Whether a padded pixel takes part.
    pub fn used(&self, pixel: usize) -> bool {
        !self.phase[pixel].is_nan()
    }
}
