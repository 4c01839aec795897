//! What short exposures are off by as a whole, seen against the long ones.

use crate::Flags;
use crate::averaging::fusion::{DOUBTFUL, Exposure};

/// Octaves of amplitude, from 2^-16 on.
const OCTAVES: usize = 48;

/// Fewer pixels of an octave say nothing of it. A choice: their median is known to a third of a standard deviation of
/// one difference.
const FEWEST_PIXELS: usize = 16;

/// Variance of a median for each unit of that of a mean of normal values.
const MEDIAN: f64 = std::f64::consts::FRAC_PI_2;

/// Square of the bias of one exposure by octave of its amplitude, square metre.
pub(crate) struct Bias([f64; OCTAVES]);

impl Bias {
    /// The median difference to the longest exposure that a pixel has beside it, less what noise makes of it; zero where
    /// too few pixels tell, and of the longest exposure.
    pub(crate) fn of(exposure: &Exposure<'_>, exposures: &[Exposure<'_>], normal_sigma_m: f64) -> Self {
        let mut differences: Vec<Vec<(f64, f64)>> = vec![Vec::new(); OCTAVES];
        let mut longer: Vec<&Exposure<'_>> =
            exposures.iter().filter(|other| other.integration_time_s > exposure.integration_time_s).collect();
        longer.sort_by(|a, b| b.integration_time_s.total_cmp(&a.integration_time_s));
        for pixel in 0..exposure.frame.range.as_slice().len() {
            let Some((range, variance)) = value(exposure, pixel, normal_sigma_m) else { continue };
            let Some(octave) = octave(f64::from(exposure.frame.amplitude.as_slice()[pixel])) else { continue };
            let reference = longer.iter().find_map(|other| value(other, pixel, normal_sigma_m));
            if let Some((other, its_variance)) = reference {
                differences[octave].push((range - other, variance + its_variance));
            }
        }
        let mut squares = [0.0; OCTAVES];
        for (square, mut differences) in squares.iter_mut().zip(differences) {
            if differences.len() >= FEWEST_PIXELS {
                let count = differences.len() as f64;
                let variance = differences.iter().map(|(_, variance)| variance).sum::<f64>() / count;
                let middle = differences.len() / 2;
                let (median, _) = *differences.select_nth_unstable_by(middle, |a, b| a.0.total_cmp(&b.0)).1;
                *square = (median * median - MEDIAN * variance / count).max(0.0);
            }
        }
        Self(squares)
    }

    /// Square of the bias at an amplitude.
    pub(crate) fn square(&self, amplitude: f64) -> f64 {
        octave(amplitude).map_or(0.0, |octave| self.0[octave])
    }
}

/// Range and variance of a pixel that nothing is said against.
fn value(exposure: &Exposure<'_>, pixel: usize, normal_sigma_m: f64) -> Option<(f64, f64)> {
    let frame = exposure.frame;
    let (range, sigma) = (f64::from(frame.range.as_slice()[pixel]), f64::from(frame.sigma.as_slice()[pixel]));
    let doubtful = frame.flags.as_slice()[pixel].intersects(DOUBTFUL | Flags::SATURATED);
    (range.is_finite() && sigma > 0.0 && sigma <= normal_sigma_m && !doubtful).then_some((range, sigma * sigma))
}

/// NaN and what is not positive have none.
fn octave(amplitude: f64) -> Option<usize> {
    let octave = amplitude.log2() + 16.0;
    (octave >= 0.0 && octave.is_finite()).then_some((octave as usize).min(OCTAVES - 1))
}
