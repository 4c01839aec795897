//! Modulus and angle of complex numbers in loops that the compiler can vectorise: no branch, no library call.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use crate::rasters::wide::Arithmetic;

/// Coefficients of `atan(t) / t` in rising powers of `t^2`, fitted on `0 <= t <= 1` for the smallest greatest error
/// (4e-8 rad).
const ARCTANGENT: [f32; 8] = [
    0.999_999_34,
    -0.333_298_6,
    0.199_465_66,
    -0.139_086_29,
    0.096_421_95,
    -0.055_912_297,
    0.021_862_936,
    -0.004_054_561_3,
];

/// `sqrt(re^2 + im^2)` without overflow or underflow of the squares; NaN if either part is NaN.
#[inline(always)]
pub(crate) fn modulus<A: Arithmetic>(re: f32, im: f32) -> f32 {
    let (large, ratio) = ordered(re, im);
    large * A::multiply_add(ratio, ratio, 1.0).sqrt()
}

/// Angle of `re + i im` in `[0, 2 pi)`, zero for `0 + 0i`; NaN if either part is NaN.
#[inline(always)]
pub(crate) fn angle<A: Arithmetic>(re: f32, im: f32) -> f32 {
    let (_, ratio) = ordered(re, im);
    let octant = ratio * octic::<A>(&ARCTANGENT, ratio * ratio);
    let quadrant = if re.abs() < im.abs() { FRAC_PI_2 - octant } else { octant };
    let half = if re < 0.0 { PI - quadrant } else { quadrant };
    let full = if im < 0.0 { TAU - half } else { half };
    // A tiny negative angle rounds up to 2 pi itself, which is the same direction as zero.
    if full >= TAU { 0.0 } else { full }
}

/// A polynomial of eight coefficients, in pairs and pairs of pairs, so that a processor need not wait for each product.
#[inline(always)]
fn octic<A: Arithmetic>([a, b, c, d, e, f, g, h]: &[f32; 8], x: f32) -> f32 {
    let square = x * x;
    let low = A::multiply_add(A::multiply_add(*d, x, *c), square, A::multiply_add(*b, x, *a));
    let high = A::multiply_add(A::multiply_add(*h, x, *g), square, A::multiply_add(*f, x, *e));
    A::multiply_add(high, square * square, low)
}

/// The larger magnitude of the two parts, and the smaller over the larger.
#[inline(always)]
fn ordered(re: f32, im: f32) -> (f32, f32) {
    let (a, b) = (re.abs(), im.abs());
    // Written so that a NaN in either part reaches the ratio: comparisons with NaN are false.
    let (large, small) = if a < b { (b, a) } else { (a, b) };
    let least = f32::from_bits(1);
    let divisor = if least > large { least } else { large };
    (large, small / divisor)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rasters::wide::Separate;

    #[test]
    fn angle_and_modulus_agree_with_the_library_in_double_precision() {
        for step in 0..100_000 {
            let direction = f64::from(step) * std::f64::consts::TAU / 100_000.0;
            let scale = 10_f64.powi(step % 60 - 30);
            let (re, im) = ((scale * direction.cos()) as f32, (scale * direction.sin()) as f32);
            let (x, y) = (f64::from(re), f64::from(im));
            let truth = y.atan2(x).rem_euclid(std::f64::consts::TAU);
            let error = (f64::from(angle::<Separate>(re, im)) - truth + 3.0).rem_euclid(std::f64::consts::TAU) - 3.0;
            // Fit 4e-8, f32's own 2 pi 1.7e-7, polynomial 1e-7, and half a unit in the last place at 2 pi, 2.4e-7.
            assert!(error.abs() < 6e-7, "direction {direction}: error {error:e} rad");
            let relative = f64::from(modulus::<Separate>(re, im)) / x.hypot(y) - 1.0;
            // Four roundings of 6e-8 each at most.
            assert!(relative.abs() < 2.4e-7, "direction {direction}: relative error {relative:e}");
        }
    }

    #[test]
    fn special_values_are_answered() {
        assert!(angle::<Separate>(0.0, 0.0).abs() < f32::MIN_POSITIVE);
        assert!(modulus::<Separate>(0.0, 0.0).abs() < f32::MIN_POSITIVE);
        assert!(angle::<Separate>(1.0, -1e-20) < TAU);
        for (re, im) in [(f32::NAN, 1.0), (1.0, f32::NAN), (0.0, f32::NAN), (f32::NAN, 0.0)] {
            assert!(angle::<Separate>(re, im).is_nan() && modulus::<Separate>(re, im).is_nan());
        }
    }
}
