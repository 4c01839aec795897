//! The periodic terms of Eq. 14 in single precision on blocks of pixels.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use std::f32::consts::PI;
use std::f64::consts::TAU;

use crate::RangeTerms;
use crate::correction::kernel::{LANES, Lanes, ROUND};

/// Coefficients of `sin(pi t) / t` in rising powers of `t^2`, through the Chebyshev nodes of `|t| <= 1/2`, where it is
/// good to 4e-8.
const SINE: [f32; 5] = [PI, -5.167_710_3, 2.550_077_4, -0.598_290_4, 0.077_655_91];
/// Coefficients of `cos(pi t)` in the same way, good to 1.3e-7.
const COSINE: [f32; 5] = [1.0, -4.934_798_7, 4.058_531, -1.332_639_5, 0.221_214_38];

/// Sines and cosines of the wavelengths U, U/2, U/4.
pub(crate) struct Sines {
    inverse_interval: f32,
    coefficients: [f32; 6],
    /// The coefficients times the wave number of their wavelength.
    slopes: [f32; 6],
}

impl Sines {
    pub(crate) fn new(terms: &RangeTerms, ambiguity_interval_m: f64) -> Self {
        let wave_number = |index: usize| TAU / ambiguity_interval_m * f64::from(1_u8 << (index / 2));
        Self {
            inverse_interval: (1.0 / ambiguity_interval_m) as f32,
            coefficients: terms.periodic.map(|d| d as f32),
            slopes: std::array::from_fn(|index| (terms.periodic[index] * wave_number(index)) as f32),
        }
    }

    /// Values and derivatives with respect to the range: one sine and cosine at half the longest wave's angle, doubled
    /// three times.
    #[inline(always)]
    pub(crate) fn put(&self, range: &Lanes, value: &mut Lanes, derivative: &mut Lanes) {
        let [d2, d3, d4, d5, d6, d7] = self.coefficients;
        let [s2, s3, s4, s5, s6, s7] = self.slopes;
        for lane in 0..LANES {
            let intervals = range[lane] * self.inverse_interval;
            let first = octave(sin_cos_of_half_turns(intervals - ((intervals + ROUND) - ROUND)));
            let second = octave(first);
            let third = octave(second);
            value[lane] =
                (d2 * first.0 + d3 * first.1) + (d4 * second.0 + d5 * second.1) + (d6 * third.0 + d7 * third.1);
            derivative[lane] =
                (s2 * first.1 - s3 * first.0) + (s4 * second.1 - s5 * second.0) + (s6 * third.1 - s7 * third.0);
        }
    }
}

/// Sine and cosine of an angle in units of pi, from -1/2 to 1/2.
#[inline(always)]
fn sin_cos_of_half_turns(t: f32) -> (f32, f32) {
    let square = t * t;
    let polynomial = |[a, b, c, d, e]: [f32; 5]| a + square * (b + square * (c + square * (d + square * e)));
    (t * polynomial(SINE), polynomial(COSINE))
}

/// Sine and cosine of the doubled angle.
#[inline(always)]
fn octave((sin, cos): (f32, f32)) -> (f32, f32) {
    let twice = sin + sin;
    (twice * cos, 1.0 - twice * sin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_are_good_to_single_precision() {
        for step in -1000..=1000 {
            let t = f64::from(step) / 2000.0;
            let (sin, cos) = sin_cos_of_half_turns(t as f32);
            let (true_sin, true_cos) = (std::f64::consts::PI * t).sin_cos();
            // Two units in the last place of 1, and what the polynomials miss (1.3e-7).
            let tolerance = 3e-7;
            assert!((f64::from(sin) - true_sin).abs() < tolerance, "sin of {t} half turns");
            assert!((f64::from(cos) - true_cos).abs() < tolerance, "cos of {t} half turns");
        }
    }
}
