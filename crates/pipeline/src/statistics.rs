//! Order statistics of samples that may hold NaN.

/// The `share` quantile (0 to 1) of the finite values, by linear interpolation; NaN where there are none.
///
/// Reorders `values`.
pub fn quantile(values: &mut [f64], share: f64) -> f64 {
    let finite = partition_finite(values);
    if finite.is_empty() {
        return f64::NAN;
    }
    let position = share.clamp(0.0, 1.0) * (finite.len() - 1) as f64;
    let below = position as usize;
    let (_, &mut low, above) = finite.select_nth_unstable_by(below, f64::total_cmp);
    let high = above.iter().copied().min_by(f64::total_cmp).unwrap_or(low);
    low + (position - below as f64) * (high - low)
}

/// The median of the finite values; NaN where there are none.
pub fn median(values: &mut [f64]) -> f64 {
    quantile(values, 0.5)
}

/// Robust standard deviation: 1.4826 times the median absolute deviation from the median.
pub fn robust_standard_deviation(values: &[f64]) -> f64 {
    let mut work = values.to_vec();
    let centre = median(&mut work);
    for value in &mut work {
        *value = (*value - centre).abs();
    }
    1.4826 * median(&mut work)
}

/// Keeps samples whose standardised residual lies within so many robust standard deviations of the median.
pub fn retain_within<T>(samples: &mut Vec<T>, deviations: f64, standardised: impl Fn(&T) -> f64) {
    let mut all: Vec<f64> = samples.iter().map(&standardised).collect();
    let limit = deviations * robust_standard_deviation(&all);
    let middle = median(&mut all);
    samples.retain(|sample| (standardised(sample) - middle).abs() <= limit);
}

fn partition_finite(values: &mut [f64]) -> &mut [f64] {
    let mut count = 0;
    for index in 0..values.len() {
        if values[index].is_finite() {
            values.swap(index, count);
            count += 1;
        }
    }
    &mut values[..count]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_interpolate_and_skip_gaps() {
        let mut values = [4.0, f64::NAN, 1.0, 3.0, 2.0];
        assert!((median(&mut values) - 2.5).abs() < 1e-15, "between the two middle values");
        assert!((quantile(&mut values, 1.0) - 4.0).abs() < 1e-15, "the largest");
        assert!(median(&mut []).is_nan());
    }

    #[test]
    fn gross_errors_go_and_an_offset_of_all_does_not_matter() {
        let mut samples: Vec<f64> = (0..100).map(|k| 50.0 + f64::from(k % 5)).chain([90.0, -20.0]).collect();
        retain_within(&mut samples, 4.0, |sample| *sample);
        assert_eq!(samples.len(), 100);
    }

    #[test]
    fn robust_deviation_of_normal_quantiles() {
        // Three quarters of a normal distribution lie within 1.15 sigma: the factor 1.4826 is 1 / 0.6745.
        let values: Vec<f64> = (-1000..=1000).map(f64::from).collect();
        assert!((robust_standard_deviation(&values) - 741.3).abs() < 0.5, "half of the span of 1000, times 1.4826");
    }
}
