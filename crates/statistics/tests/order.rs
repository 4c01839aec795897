//! Quantiles with and without interpolation.

use proptest::prelude::*;
use statistics::{quantile, ranked, upper_median};

#[test]
fn quantiles_interpolate_and_skip_gaps() {
    let mut values = [4.0, f64::NAN, 1.0, 3.0, 2.0];
    assert_eq!(quantile(&mut values, 0.5), 2.5, "between the two middle values");
    assert_eq!(quantile(&mut values, 1.0), 4.0, "the largest");
    assert_eq!(quantile(&mut values, 7.0), 4.0, "shares beyond the ends are the ends");
    assert!(quantile(&mut [], 0.5).is_nan() && quantile(&mut [f64::NAN], 0.5).is_nan());
}

#[test]
fn ranks_of_short_slices() {
    assert!(ranked::<f64>(&mut [], 0.5).is_nan() && upper_median::<f32>(&mut []).is_nan());
    assert_eq!(ranked(&mut [3.0, 1.0, 2.0], 0.5), 2.0);
    assert_eq!(ranked(&mut [3.0, 1.0], 1.0), 3.0);
    assert_eq!(upper_median(&mut [3.0_f32, 1.0]), 3.0);
}

proptest! {
    #[test]
    fn values_of_a_rank_are_those_of_the_sorted(mut values in prop::collection::vec(-1e3..1e3_f64, 1..40)) {
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        prop_assert_eq!(upper_median(&mut values), sorted[sorted.len() / 2]);
        let between = quantile(&mut values, 0.5);
        let expected = f64::midpoint(sorted[(sorted.len() - 1) / 2], sorted[sorted.len() / 2]);
        // One rounding of numbers up to a thousand.
        prop_assert!((between - expected).abs() < 1e-12);
    }
}
