//! Phase noise: what the caller knows of it, or how large it is by the image itself.

use range_image::Raster;

use crate::{Error, Result};

/// What is known about the standard deviation of the phases.
#[derive(Debug, Clone, Copy, Default)]
pub enum PhaseNoise<'a> {
    /// Nothing: one figure for the whole image is estimated from it.
    #[default]
    Unknown,
    /// The same everywhere, in radians.
    Uniform(f32),
    /// Of each pixel, in radians. What is not finite counts as [`LARGEST_SIGMA_RAD`].
    Sigma(&'a Raster<f32>),
    /// Amplitudes in any unit: the deviation goes as `1 / amplitude`, its scale is estimated from the image.
    Amplitude(&'a Raster<f32>),
}

/// A phase noisier than this says nothing, in radians: the distribution is flat to 3 %.
pub const LARGEST_SIGMA_RAD: f32 = 2.7;
/// The smallest deviation that is told from none, in radians; bounds the ratio of the weights.
const SMALLEST_SIGMA_RAD: f32 = 0.02;
/// Side of the blocks in which the noise is measured, in pixels. Larger ones miss where noise changes, smaller ones
/// hold fewer than the pairs below.
const BLOCK: usize = 16;
/// Pairs of neighbours from which a block is measured. A choice, a tenth of those of a block; a deviation from so many
/// is known to a tenth.
const FEWEST_PAIRS: f32 = 48.0;
/// Squared coherence of neighbours below which the noise is not told from a flat distribution: 1.5 rad.
const LEAST_COHERENCE: f32 = 0.011;

impl PhaseNoise<'_> {
    pub(crate) fn validate(&self, phase: &Raster<f32>) -> Result<()> {
        match *self {
            Self::Unknown => Ok(()),
            Self::Uniform(sigma) if sigma.is_finite() && sigma >= 0.0 => Ok(()),
            Self::Uniform(sigma) => {
                let expected = "finite and not negative";
                Err(Error::OutOfDomain { name: "uniform phase noise in radians", value: sigma.into(), expected })
            }
            Self::Sigma(sigma) => {
                phase.require_same_size(sigma, "sigma")?;
                match sigma.as_slice().iter().position(|&sigma| sigma < 0.0) {
                    None => Ok(()),
                    Some(at) => Err(Error::NegativeSigma {
                        col: at % phase.width(),
                        row: at / phase.width(),
                        value: sigma.as_slice()[at],
                    }),
                }
            }
            Self::Amplitude(amplitude) => Ok(phase.require_same_size(amplitude, "amplitude")?),
        }
    }
}

/// Weight of a unit phasor in a mean of phasors, and the share that it adds to the information about the phase.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Weight {
    /// `rho / v` with the mean of the cosine of the error, `rho = exp(-sigma^2 / 2)`, and the variance of its sine,
    /// `v = (1 - rho^4) / 2`: the weight of the smallest variance of the mean's angle.
    pub weight: f32,
    /// `rho^2 / v`: the inverse variance of the angle of the mean is the sum of these.
    pub information: f32,
}

/// The weight that belongs to a standard deviation.
// `clamp` would keep NaN, which `min` and `max` replace.
#[allow(clippy::manual_clamp)]
#[inline]
pub(crate) fn weight(sigma_rad: f32) -> Weight {
    let sigma = sigma_rad.min(LARGEST_SIGMA_RAD).max(SMALLEST_SIGMA_RAD);
    // exp(s^2 / 2) as the eighth power of a short series: good to 0.2 %, and no library call.
    let part = sigma * sigma / 16.0;
    let root = 1.0 + part * (1.0 + part / 2.0 * (1.0 + part / 3.0 * (1.0 + part / 4.0)));
    let (square, fourth) = (root * root, root * root * root * root);
    let rho = 1.0 / (square * square * fourth);
    let fourth = rho * rho * rho * rho;
    let weight = 2.0 * rho / (1.0 - fourth);
    Weight { weight, information: weight * rho }
}

/// Standard deviation of the phase in radians from the coherence of neighbours, or with amplitudes the deviation times
/// the amplitude; `None` where no block of the image has enough pairs of neighbours.
///
/// On a plane of any slope the products of neighbouring phasors share one direction, and their mean has the length
/// `exp(-sigma^2)`. The middle of all blocks is taken: jumps and curved surfaces spoil some.
pub(crate) fn estimate(
    width: usize,
    planes: [&[f32]; 2],
    amplitude: Option<&[f32]>,
    found: &mut Vec<f32>,
) -> Option<f32> {
    let height = planes[0].len() / width;
    found.clear();
    for row in (0..height).step_by(BLOCK) {
        for col in (0..width).step_by(BLOCK) {
            let size = [BLOCK.min(width - col), BLOCK.min(height - row)];
            let scale = amplitude.map_or(Some(1.0), |plane| mean_amplitude(width, plane, [col, row], size));
            for step in [1, width] {
                let reach = if step == 1 { [size[0] - 1, size[1]] } else { [size[0], size[1] - 1] };
                let coherence = block_coherence(width, planes, [col, row], reach, step);
                if let (Some(coherence), Some(scale)) = (coherence, scale) {
                    found.push((-0.5 * coherence.clamp(LEAST_COHERENCE, 1.0).ln()).sqrt() * scale);
                }
            }
        }
    }
    (!found.is_empty()).then(|| statistics::upper_median(found))
}

/// Squared length of the expected product of neighbours, free of the bias that the noise of the sum gives to its
/// square.
fn block_coherence(
    width: usize,
    [re, im]: [&[f32]; 2],
    first: [usize; 2],
    size: [usize; 2],
    step: usize,
) -> Option<f32> {
    let (mut sum, mut pairs) = ([0.0_f32; 2], 0.0_f32);
    for row in first[1]..first[1] + size[1] {
        let start = row * width + first[0];
        let one = start..start + size[0];
        let other = start + step..start + step + size[0];
        let one = re[one.clone()].iter().zip(&im[one]);
        for ((a, b), (c, d)) in one.zip(re[other.clone()].iter().zip(&im[other])) {
            sum[0] += a * c + b * d;
            sum[1] += a * d - b * c;
            // Masked pixels have phasors of length zero.
            pairs += (a * a + b * b) * (c * c + d * d);
        }
    }
    let square = sum[0] * sum[0] + sum[1] * sum[1];
    (pairs >= FEWEST_PAIRS).then(|| (square - pairs) / (pairs * (pairs - 1.0)))
}

fn mean_amplitude(width: usize, amplitude: &[f32], first: [usize; 2], size: [usize; 2]) -> Option<f32> {
    let (mut sum, mut count) = (0.0, 0.0);
    for row in first[1]..first[1] + size[1] {
        for value in &amplitude[row * width + first[0]..][..size[0]] {
            let usable = value.is_finite() && *value > 0.0;
            sum += if usable { *value } else { 0.0 };
            count += if usable { 1.0 } else { 0.0 };
        }
    }
    (count > 0.0).then_some(sum / count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_follow_their_formula() {
        for sigma in [0.02_f32, 0.1, 0.5, 1.0, 2.0, 2.7] {
            let rho = (-f64::from(sigma).powi(2) / 2.0).exp();
            let expected = 2.0 * rho / (1.0 - rho.powi(4));
            let found = weight(sigma);
            // The series is good to 0.2 %; at 0.02 rad the difference from one is rounded to 1.5e-4 of itself.
            assert!((f64::from(found.weight) / expected - 1.0).abs() < 3e-3, "{sigma}: {found:?} for {expected}");
            assert!((f64::from(found.information) / (expected * rho) - 1.0).abs() < 5e-3, "{sigma}: {found:?}");
        }
        assert!((weight(f32::NAN).weight - weight(LARGEST_SIGMA_RAD).weight).abs() < 1e-9);
        assert!((weight(0.0).weight - weight(SMALLEST_SIGMA_RAD).weight).abs() < 1e-9);
    }
}
