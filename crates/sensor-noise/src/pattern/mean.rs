//! The robust mean of a pixel's residuals over walls.

use statistics::{SIGMA_OF_MAD, quantile};

/// Residuals beyond so many of their deviations weigh less (`[Huber1981]`).
const HUBER: f64 = 1.345;
/// Rounds of weighting.
const ROUNDS: usize = 20;

/// Mean and its standard deviation; `None` without a value.
///
/// Each value has its variance; where the values scatter more than these say, as walls at several distances do, the
/// deviation grows with the scatter.
pub(super) fn robust_mean(values: &[(f64, f64)]) -> Option<(f64, f64)> {
    if values.is_empty() {
        return None;
    }
    let mut mean = quantile(&mut values.iter().map(|(value, _)| *value).collect::<Vec<_>>(), 0.5);
    // Three values and fewer tell no scale; of few values the median is interpolated.
    let scale = if values.len() > 3 {
        let sizes = values.iter().map(|(value, variance)| ((value - mean) / variance.sqrt()).abs());
        SIGMA_OF_MAD * quantile(&mut sizes.collect::<Vec<_>>(), 0.5)
    } else {
        1.0
    };
    let limit = HUBER * scale.max(1.0);
    let weight = |(value, variance): &(f64, f64), mean: f64| {
        let standardised = ((value - mean) / variance.sqrt()).abs();
        if standardised <= limit { variance.recip() } else { limit / standardised / variance }
    };
    for _ in 0..ROUNDS {
        let total: f64 = values.iter().map(|value| weight(value, mean)).sum();
        let next = values.iter().map(|value| weight(value, mean) * value.0).sum::<f64>() / total;
        let settled = (next - mean).abs() * total.sqrt() < 1e-6;
        mean = next;
        if settled {
            break;
        }
    }
    let total: f64 = values.iter().map(|value| weight(value, mean)).sum();
    let freedom = values.len() as f64 - 1.0;
    let squares: f64 = values.iter().map(|value| weight(value, mean) * (value.0 - mean).powi(2)).sum();
    let inflation = if freedom > 0.0 { (squares / freedom).max(1.0) } else { 1.0 };
    Some((mean, (inflation / total).sqrt()))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn values_that_agree_give_their_weighted_mean() {
        let (mean, sigma) = robust_mean(&[(1.0, 0.01), (1.05, 0.04)]).unwrap();
        // Weights 100 and 25.
        assert_relative_eq!(mean, 1.01, epsilon = 1e-9);
        assert_relative_eq!(sigma, 125.0_f64.recip().sqrt(), max_relative = 1e-9);
        assert!(robust_mean(&[]).is_none());
        assert_relative_eq!(robust_mean(&[(2.0, 0.09)]).unwrap().1, 0.3, max_relative = 1e-12);
    }

    #[test]
    fn one_wild_value_does_not_carry_the_mean() {
        let mut values = vec![(0.1, 1.0), (-0.4, 1.0), (0.6, 1.0), (-0.2, 1.0), (0.3, 1.0)];
        let calm = robust_mean(&values).unwrap();
        values.push((50.0, 1.0));
        let wild = robust_mean(&values).unwrap();
        assert!((wild.0 - calm.0).abs() < 0.5 && wild.1 > calm.1, "{wild:?}");
    }
}
