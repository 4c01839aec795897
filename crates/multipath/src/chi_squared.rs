//! The chi-squared distribution with whole degrees of freedom.

use std::f64::consts::{FRAC_2_SQRT_PI, PI};

/// Probability that a chi-squared variable with `freedom` degrees of freedom exceeds `x`; NaN without freedom.
pub(crate) fn survival(x: f64, freedom: usize) -> f64 {
    if freedom == 0 || x.is_nan() {
        return f64::NAN;
    }
    if x <= 0.0 {
        return 1.0;
    }
    let half = x / 2.0;
    let even = freedom.is_multiple_of(2);
    // Q(n + 2) = Q(n) + (x/2)^(n/2) e^(-x/2) / Gamma(n/2 + 1)
    let (mut sum, mut term, first) = if even {
        ((-half).exp(), half * (-half).exp(), 2)
    } else {
        (complementary_error(half.sqrt()), half.sqrt() * (-half).exp() * FRAC_2_SQRT_PI, 1)
    };
    for n in (first..freedom).step_by(2) {
        sum += term;
        term *= half / (n as f64 / 2.0 + 1.0);
    }
    sum.min(1.0)
}

/// The value that is exceeded with `probability` (between 0 and 1); infinite without freedom.
pub(crate) fn quantile(probability: f64, freedom: usize) -> f64 {
    if freedom == 0 {
        return f64::INFINITY;
    }
    let (mut low, mut high) = (0.0, 1.0);
    while survival(high, freedom) > probability && high < 1e4 {
        high *= 2.0;
    }
    // Fifty halvings leave less than the rounding of the bounds.
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if survival(middle, freedom) > probability { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// `erfc(t)` for `t >= 0`.
fn complementary_error(t: f64) -> f64 {
    if t < 2.0 {
        // erf t = 2/sqrt(pi) e^(-t^2) sum 2^n t^(2n+1) / (2n+1)!!
        let (mut term, mut sum) = (t, t);
        for n in 1..60 {
            term *= 2.0 * t * t / (2.0 * f64::from(n) + 1.0);
            sum += term;
        }
        return 1.0 - FRAC_2_SQRT_PI * (-t * t).exp() * sum;
    }
    let fraction = (1..80).rev().fold(t, |tail, n| t + f64::from(n) / 2.0 / tail);
    (-t * t).exp() / (PI.sqrt() * fraction)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        // Tables give three decimals.
        let table = [
            (0.001, 1, 10.828),
            (0.001, 2, 13.816),
            (0.001, 3, 16.266),
            (0.001, 4, 18.467),
            (0.001, 6, 22.458),
            (0.05, 1, 3.841),
            (0.05, 5, 11.070),
            (0.05, 10, 18.307),
        ];
        for (probability, freedom, expected) in table {
            let found = quantile(probability, freedom);
            assert!((found - expected).abs() < 6e-4, "{probability} {freedom}: {found}");
            assert!((survival(found, freedom) / probability - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn both_branches_of_the_error_function_meet() {
        let (below, above) = (complementary_error(2.0 - 1e-12), complementary_error(2.0 + 1e-12));
        // erfc changes by 4e-14 between the two.
        assert!((below - above).abs() < 1e-13, "{below} {above}");
        assert!((survival(1.959_963_984_540_054_f64.powi(2), 1) - 0.05).abs() < 1e-14);
    }

    #[test]
    fn special_values_are_answered() {
        assert!(survival(1.0, 0).is_nan() && survival(f64::NAN, 2).is_nan());
        assert!((survival(-1.0, 3) - 1.0).abs() < f64::EPSILON);
        assert!(quantile(0.01, 0).is_infinite());
    }
}
