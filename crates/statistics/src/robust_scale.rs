//! The scale of values that hold gross errors.

use crate::{quantile, upper_median};

/// Standard deviation of normal values over the median of their moduli, `1 / Φ⁻¹(3/4)` \[Huber1981\].
pub const SIGMA_OF_MAD: f64 = 1.482_602_218_505_601_9;

/// Medians of the length of a vector of one, two, three, four standard normal values.
pub const CHI_MEDIANS: [f64; 4] =
    [0.674_489_750_196_081_7, 1.177_410_022_515_474_7, 1.538_172_254_455_052_3, 1.832_128_265_169_587_2];

/// Standard deviation of normal residuals from the upper median of their absolute values, blind to gross errors below a
/// half. NaN of nothing; reorders them.
///
/// ```
/// let scale = statistics::mad_scale(&mut [0.3, 0.5, 0.6, 0.8, 100.0]);
/// assert!((scale - 0.89).abs() < 0.01);
/// ```
pub fn mad_scale(absolute: &mut [f64]) -> f64 {
    SIGMA_OF_MAD * upper_median(absolute)
}

/// Standard deviation of finite values about their median, with the medians interpolated: for samples whose centre is not
/// known. NaN of nothing.
pub fn robust_standard_deviation(values: &[f64]) -> f64 {
    let mut work = values.to_vec();
    let centre = quantile(&mut work, 0.5);
    for value in &mut work {
        *value = (*value - centre).abs();
    }
    SIGMA_OF_MAD * quantile(&mut work, 0.5)
}

/// Keeps samples whose standardised residual lies within so many robust standard deviations of the median.
///
/// ```
/// let mut samples: Vec<f64> = (0..100).map(|k| 50.0 + f64::from(k % 5)).chain([90.0, -20.0]).collect();
/// statistics::retain_within(&mut samples, 4.0, |sample| *sample);
/// assert_eq!(samples.len(), 100);
/// ```
pub fn retain_within<T>(samples: &mut Vec<T>, deviations: f64, standardised: impl Fn(&T) -> f64) {
    let mut all: Vec<f64> = samples.iter().map(&standardised).collect();
    let limit = deviations * robust_standard_deviation(&all);
    let middle = quantile(&mut all, 0.5);
    samples.retain(|sample| (standardised(sample) - middle).abs() <= limit);
}
