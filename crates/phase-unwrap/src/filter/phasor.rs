//! Unit phasors and angles in loops that the compiler can vectorise: no branch, no library call.

use std::f32::consts::{FRAC_2_PI, FRAC_PI_2, PI, TAU};

/// Coefficients of `sin(t) / t` in powers of `t^2` for `|t| <= pi / 4` (Taylor; the next term is below 2e-9).
const SINE: [f32; 5] = [1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362_880.0];
/// Coefficients of `cos(t)` in powers of `t^2` for `|t| <= pi / 4` (Taylor; the next term is below 3e-8).
const COSINE: [f32; 5] = [1.0, -0.5, 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40_320.0];
/// Coefficients of `atan(t) / t` in powers of `t^2`, fitted on `0 <= t <= 1` (2e-6 rad: far below any noise here).
const ARCTANGENT: [f32; 6] = [0.999_977_26, -0.332_623_47, 0.193_543_46, -0.116_432_87, 0.052_653_32, -0.011_721_2];

#[inline]
fn polynomial<const N: usize>(coefficients: &[f32; N], square: f32) -> f32 {
    coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * square + coefficient)
}

/// `[cos, sin]` of a phase in `[0, 2 pi]`, good to 3e-7.
#[inline]
pub(crate) fn unit(phase: f32) -> [f32; 2] {
    let quarter = (phase * FRAC_2_PI + 0.5) as i32;
    let rest = phase - quarter as f32 * FRAC_PI_2;
    let square = rest * rest;
    let sine = rest * polynomial(&SINE, square);
    let cosine = polynomial(&COSINE, square);
    let odd = quarter & 1 != 0;
    let (along, across) = if odd { (sine, cosine) } else { (cosine, sine) };
    // The quarters 1 and 2 have a negative cosine, the quarters 2 and 3 a negative sine.
    let negative_cosine = (quarter + 1) & 2 != 0;
    let negative_sine = quarter & 2 != 0;
    [if negative_cosine { -along } else { along }, if negative_sine { -across } else { across }]
}

/// Angle of `re + i im` in `[0, 2 pi)`, good to 3e-6; zero for `0 + 0i`.
#[inline]
pub(crate) fn angle(re: f32, im: f32) -> f32 {
    let (a, b) = (re.abs(), im.abs());
    let (large, small) = if a < b { (b, a) } else { (a, b) };
    let ratio = small / large.max(f32::MIN_POSITIVE);
    let octant = ratio * polynomial(&ARCTANGENT, ratio * ratio);
    let quadrant = if a < b { FRAC_PI_2 - octant } else { octant };
    let half = if re < 0.0 { PI - quadrant } else { quadrant };
    let full = if im < 0.0 { TAU - half } else { half };
    if full >= TAU { 0.0 } else { full }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phasors_and_angles_agree_with_the_library() {
        for step in 0..=100_000 {
            let phase = (f64::from(step) * std::f64::consts::TAU / 100_000.0) as f32;
            let phase = phase.min(TAU);
            let [cosine, sine] = unit(phase);
            let (true_sine, true_cosine) = f64::from(phase).sin_cos();
            // The reduction loses half a unit in the last place at 2 pi, 2.4e-7; the polynomials 1e-7.
            assert!((f64::from(cosine) - true_cosine).abs() < 5e-7, "{phase}: {cosine}");
            assert!((f64::from(sine) - true_sine).abs() < 5e-7, "{phase}: {sine}");
            let back = f64::from(angle(3.0 * cosine, 3.0 * sine));
            let error = (back - f64::from(phase) + 3.0).rem_euclid(std::f64::consts::TAU) - 3.0;
            // The fit's 2e-6 and the rounding of the parts.
            assert!(error.abs() < 4e-6, "{phase}: {back}");
        }
        assert!(angle(0.0, 0.0).abs() < f32::MIN_POSITIVE && angle(1.0, -1e-20) < TAU);
    }
}
