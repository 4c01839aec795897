//! How points scatter by their range.

use super::*;

#[test]
fn a_power_of_the_range_is_found_and_ends_with_the_patches() {
    let ranges = [1.0_f64, 1.5, 2.0, 3.0];
    let medians = ranges.map(|range| (range.ln(), (0.002 * range.powf(1.3)).powi(2).ln()));
    let law = NoiseLaw::through(&medians);
    for range in ranges {
        // Exact up to rounding.
        assert!((law.factor(range) - 0.002 * range.powf(1.3)).abs() < 1e-12);
    }
    assert!((law.factor(30.0) - law.factor(3.0)).abs() < 1e-15);
    assert!((NoiseLaw::through(&medians[..1]).factor(7.0) - 0.002).abs() < 1e-12);
    assert!(NoiseLaw::through(&[]).factor(2.0).is_finite());
}
