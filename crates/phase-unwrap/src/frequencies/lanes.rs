//! Blocks of pixels that are worked on side by side: fixed arrays, so that the compiler keeps them in wide registers.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

/// Pixels of a block.
pub(crate) const LANES: usize = 16;

/// One value for each pixel of a block.
pub(crate) type Lanes = [f32; LANES];

/// One and a half times 2²³: a number of this size has no bits behind the point.
pub(crate) const ROUNDER: f32 = 12_582_912.0;

/// The nearest whole number, ties to even, for values below 2²² in size; without a call into the library.
#[inline(always)]
pub(crate) fn nearest(x: f32) -> f32 {
    (x + ROUNDER) - ROUNDER
}

/// One of two values, both already there: no branch.
#[inline(always)]
pub(crate) fn select(condition: bool, yes: f32, no: f32) -> f32 {
    if condition { yes } else { no }
}

/// `e^x` for x up to 0, to four parts in a million; 0 below -80.
#[inline(always)]
pub(crate) fn exp_negative(x: f32) -> f32 {
    let power = x.max(-80.0) * std::f32::consts::LOG2_E;
    let rounded = power + ROUNDER;
    let rest = (power - (rounded - ROUNDER)) * std::f32::consts::LN_2;
    let series = 1.0 + rest * (1.0 + rest * (0.5 + rest * (1.0 / 6.0 + rest * (1.0 / 24.0 + rest * (1.0 / 120.0)))));
    // The low bits of the sum are the whole power itself; it becomes an exponent.
    let exponent = rounded.to_bits().wrapping_sub(ROUNDER.to_bits()).wrapping_add(127) << 23;
    let value = series * f32::from_bits(exponent);
    if x < -80.0 { 0.0 } else { value }
}

/// The values of a plane from `start`, as many as `count` says; NaN in the other lanes.
#[inline(always)]
pub(crate) fn gather(plane: &[f32], start: usize, count: usize) -> Lanes {
    let values = &plane[start..][..count];
    if let Some(whole) = values.first_chunk() {
        return *whole;
    }
    let mut lanes = [f32::NAN; LANES];
    lanes[..count].copy_from_slice(values);
    lanes
}

/// Writes the first `count` lanes into a plane from `start`.
#[inline(always)]
pub(crate) fn scatter(plane: &mut [f32], start: usize, count: usize, lanes: &Lanes) {
    let values = &mut plane[start..][..count];
    match values.first_chunk_mut() {
        Some(whole) => *whole = *lanes,
        None => values.copy_from_slice(&lanes[..count]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponentials_and_rounding_agree_with_the_library() {
        for step in 0..8000 {
            let x = -0.01 * step as f32;
            let (found, expected) = (f64::from(exp_negative(x)), f64::from(x).exp());
            // The series ends at the fifth power of 0.35: 0.35^6 / 720 = 2.6e-6; rounding of the power adds 1e-5 at -80.
            assert!((found - expected).abs() <= expected * (4e-6 + 1.5e-7 * f64::from(-x)), "{x}: {found} {expected}");
            assert!((nearest(x) - x.round_ties_even()).abs() < f32::EPSILON, "{x}");
        }
        assert!(exp_negative(-1e30) == 0.0 && exp_negative(f32::NEG_INFINITY) == 0.0);
    }
}
