//! Where most values lie, whatever the few gross ones do.

/// The `share` quantile (0 to 1) of the finite values, by linear interpolation; NaN where there are none.
pub(crate) fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut finite: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    finite.sort_unstable_by(f64::total_cmp);
    let Some(last) = finite.len().checked_sub(1) else { return f64::NAN };
    let position = share.clamp(0.0, 1.0) * last as f64;
    let below = position as usize;
    let (low, high) = (finite[below], finite[(below + 1).min(last)]);
    low + (position - below as f64) * (high - low)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_interpolate_and_skip_gaps() {
        let values = || [4.0, f64::NAN, 1.0, 3.0, 2.0].into_iter();
        assert!((quantile(values(), 0.5) - 2.5).abs() < 1e-15, "between the two middle values");
        assert!((quantile(values(), 1.0) - 4.0).abs() < 1e-15, "the largest");
        assert!(quantile(std::iter::empty(), 0.5).is_nan());
    }
}
