//! Levels of several tests at a time.

/// The level of each of several tests for a level that all of them have together.
///
/// ```
/// assert_eq!(statistics::bonferroni(0.05, 10), 0.005);
/// ```
pub fn bonferroni(level: f64, tests: usize) -> f64 {
    level / tests.max(1) as f64
}

/// Probabilities of single tests as those of several \[Holm1979\]: the k-th smallest of m times m + 1 - k, none smaller than
/// the one before and none above 1. What is not finite is no test and becomes NaN.
///
/// ```
/// let adjusted = statistics::holm(&[0.02, f64::NAN, 0.01]);
/// assert_eq!((adjusted[0], adjusted[2]), (0.02, 0.02));
/// assert!(adjusted[1].is_nan());
/// ```
pub fn holm(p_values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p_values.len()).filter(|&k| p_values[k].is_finite()).collect();
    order.sort_by(|a, b| p_values[*a].total_cmp(&p_values[*b]));
    let (count, mut largest) = (order.len(), 0.0_f64);
    let mut adjusted = vec![f64::NAN; p_values.len()];
    for (rank, index) in order.into_iter().enumerate() {
        largest = largest.max(p_values[index] * (count - rank) as f64).min(1.0);
        adjusted[index] = largest;
    }
    adjusted
}
