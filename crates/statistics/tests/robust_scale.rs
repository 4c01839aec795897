//! The scale that gross errors do not move, held against the distributions.

use approx::assert_relative_eq;
use statistics::{CHI_MEDIANS, Distribution, SIGMA_OF_MAD, mad_scale, retain_within, robust_standard_deviation};

#[test]
fn constants_are_those_of_the_distributions() {
    assert_relative_eq!(SIGMA_OF_MAD, 1.0 / CHI_MEDIANS[0], max_relative = 1e-15);
    assert_relative_eq!(SIGMA_OF_MAD, 1.0 / Distribution::Normal.quantile(0.75), max_relative = 1e-13);
    for (dof, median) in (1..5).map(f64::from).zip(CHI_MEDIANS) {
        assert_relative_eq!(median * median, Distribution::ChiSquared { dof }.quantile(0.5), max_relative = 1e-13);
    }
}

#[test]
fn quantiles_of_the_normal_distribution_have_scale_one() {
    let mut values: Vec<f64> =
        (0..1001).map(|k| Distribution::Normal.quantile((f64::from(k) + 0.5) / 1001.0)).collect();
    // The median of a thousand values is known to two thousandths.
    assert_relative_eq!(robust_standard_deviation(&values), 1.0, epsilon = 2e-3);
    for value in &mut values {
        *value = value.abs();
    }
    assert_relative_eq!(mad_scale(&mut values), 1.0, epsilon = 2e-3);
    assert!(mad_scale(&mut []).is_nan() && robust_standard_deviation(&[]).is_nan());
}

#[test]
fn the_deviation_is_about_the_median() {
    let values: Vec<f64> = (-1000..=1000).map(|k| 7.0 + f64::from(k)).collect();
    assert_relative_eq!(robust_standard_deviation(&values), 500.0 * SIGMA_OF_MAD, max_relative = 1e-12);
}

#[test]
fn gross_errors_go_and_an_offset_of_all_does_not_matter() {
    let mut samples: Vec<f64> = (0..100).map(|k| 50.0 + f64::from(k % 5)).chain([90.0, -20.0]).collect();
    retain_within(&mut samples, 4.0, |sample| *sample);
    assert_eq!(samples.len(), 100);
}
