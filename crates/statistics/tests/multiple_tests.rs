//! Several tests at a time.

use statistics::{bonferroni, holm};

#[test]
fn probabilities_after_holm() {
    // R: p.adjust(c(0.01, 0.04, 0.03, 0.005), "holm").
    let adjusted = holm(&[0.01, 0.04, 0.03, 0.005]);
    for (found, expected) in adjusted.iter().zip([0.03, 0.06, 0.06, 0.02]) {
        assert!((found - expected).abs() < 1e-15, "{adjusted:?}");
    }
    assert_eq!(holm(&[0.9, 0.8]), [1.0, 1.0]);
    assert!(holm(&[]).is_empty());
}

#[test]
fn the_smallest_probability_is_tested_as_by_bonferroni() {
    let p_values = [0.2, 0.003, 0.4];
    assert_eq!(holm(&p_values)[1] <= 0.01, p_values[1] <= bonferroni(0.01, p_values.len()));
    assert_eq!(bonferroni(0.05, 0), 0.05);
}
