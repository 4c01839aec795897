//! The natural logarithm, many at once.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

/// `ln(x)` of a positive, finite number to 2e-7 (1 + |ln x|); below the smallest normal number, that number's.
///
/// The mantissa is brought into [1/sqrt 2, sqrt 2); there `ln = 2 atanh(s)` with `s = (m - 1) / (m + 1)`.
#[inline(always)]
pub(crate) fn logarithm(x: f32) -> f32 {
    /// Bits of 1 / sqrt 2.
    const LOWEST: u32 = 0x3f35_04f3;
    let bits = x.max(f32::MIN_POSITIVE).to_bits().wrapping_sub(LOWEST);
    let exponent = (bits as i32 >> 23) as f32;
    let mantissa = f32::from_bits((bits & 0x007f_ffff) + LOWEST);
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let square = s * s;
    // The series of 2 atanh(s); |s| is at most 0.172, so the first term left out is below 1e-9.
    let series = 2.0 / 3.0 + square * (2.0 / 5.0 + square * (2.0 / 7.0 + square * (2.0 / 9.0)));
    exponent * std::f32::consts::LN_2 + (2.0 * s + s * square * series)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_logarithm() {
        let mut x = f32::MIN_POSITIVE;
        while x < 1e38 {
            let exact = f64::from(x).ln();
            assert!((f64::from(logarithm(x)) - exact).abs() < 2e-7 * (1.0 + exact.abs()), "{x}");
            x *= 1.003;
        }
        assert!(logarithm(1.0).abs() < f32::EPSILON);
        assert!((logarithm(1e-42) - f32::MIN_POSITIVE.ln()).abs() < 1e-4);
    }
}
