//! Probabilities of the tests: normal and F.

/// Quantile of the standard normal distribution for a probability in (0, 1), by Newton's method on the distribution
/// function; NaN outside.
pub(crate) fn normal_quantile(probability: f64) -> f64 {
    if !(probability > 0.0 && probability < 1.0) {
        return f64::NAN;
    }
    // By symmetry the upper tail is enough, where the tail probability keeps its digits.
    if probability < 0.5 {
        return -normal_quantile(1.0 - probability);
    }
    let tail = 1.0 - probability;
    // A bracket that halves: the tail at 40 is below every double.
    let mut bracket = [0.0, 40.0];
    for _ in 0..80 {
        let middle = f64::midpoint(bracket[0], bracket[1]);
        bracket[usize::from(0.5 * gamma_tail(0.5, 0.5 * middle * middle) < tail)] = middle;
    }
    bracket[0]
}

/// Probability that an F-distributed number of `numerator` and `denominator` degrees of freedom exceeds `value`.
/// An infinite denominator makes it chi-squared over `numerator`.
pub(crate) fn fisher_tail(numerator: f64, denominator: f64, value: f64) -> f64 {
    if value.is_nan() || numerator <= 0.0 || denominator.is_nan() || denominator <= 0.0 {
        return f64::NAN;
    }
    if value <= 0.0 {
        return 1.0;
    }
    // Beyond this the two distributions agree to seven digits, and the continued fraction begins to lose them.
    if denominator > 1e7 {
        return gamma_tail(0.5 * numerator, 0.5 * numerator * value);
    }
    let x = denominator / (denominator + numerator * value);
    incomplete_beta(0.5 * denominator, 0.5 * numerator, x, numerator * value / (denominator + numerator * value))
}

/// Regularised upper incomplete gamma function `Q(a, x)`: series for small x, continued fraction for large.
fn gamma_tail(a: f64, x: f64) -> f64 {
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > 1e-17 * sum {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        return 1.0 - front * sum;
    }
    let mut b = x + 1.0 - a;
    let mut c = f64::INFINITY;
    let mut d = 1.0 / b;
    let mut product = d;
    for index in 1..10_000 {
        let n = f64::from(index);
        let share = -n * (n - a);
        b += 2.0;
        d = 1.0 / (share * d + b);
        c = b + share / c;
        product *= c * d;
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    front * product
}

/// Regularised incomplete beta function `I_x(a, b)` with `y = 1 − x`, by its continued fraction.
fn incomplete_beta(a: f64, b: f64, x: f64, y: f64) -> f64 {
    let ln_x = if x > 0.5 { (-y).ln_1p() } else { x.ln() };
    let ln_y = if y > 0.5 { (-x).ln_1p() } else { y.ln() };
    let front = (a * ln_x + b * ln_y - ln_beta(a, b)).exp();
    if x < (a + 1.0) / (a + b + 2.0) {
        front * continued_fraction(a, b, x) / a
    } else {
        1.0 - front * continued_fraction(b, a, y) / b
    }
}

/// Lentz's evaluation.
fn continued_fraction(a: f64, b: f64, x: f64) -> f64 {
    let guard = |value: f64| if value.abs() < f64::MIN_POSITIVE { f64::MIN_POSITIVE } else { value };
    let mut c = 1.0;
    let mut d = 1.0 / guard(1.0 - (a + b) * x / (a + 1.0));
    let mut product = d;
    // It settles within tens of terms where the other end of the interval is taken for large x.
    for index in 1..10_000 {
        let m = f64::from(index);
        for term in [
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0)),
        ] {
            d = 1.0 / guard(1.0 + term * d);
            c = guard(1.0 + term / c);
            product *= c * d;
        }
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    product
}

/// `ln B(a, b)`, without the difference of large logarithms where a is large.
fn ln_beta(a: f64, b: f64) -> f64 {
    let (large, small) = if a > b { (a, b) } else { (b, a) };
    if large < 1e4 {
        return ln_gamma(large) + ln_gamma(small) - ln_gamma(large + small);
    }
    // Stirling's series of ln Γ(large) − ln Γ(large + small).
    let sum = large + small;
    let stirling = |z: f64| 1.0 / (12.0 * z) - 1.0 / (360.0 * z * z * z);
    let ratio = (large - 0.5) * -(small / large).ln_1p() - small * sum.ln() + small;
    ln_gamma(small) + ratio + stirling(large) - stirling(sum)
}

/// `ln Γ(z)` for positive z: Stirling's series after the recursion up to 12.
fn ln_gamma(z: f64) -> f64 {
    let (mut z, mut product) = (z, 1.0);
    while z < 12.0 {
        product *= z;
        z += 1.0;
    }
    let w = 1.0 / (z * z);
    let series = (1.0 / 12.0 - w * (1.0 / 360.0 - w * (1.0 / 1260.0 - w / 1680.0))) / z;
    (z - 0.5) * z.ln() - z + 0.5 * (2.0 * std::f64::consts::PI).ln() + series - product.ln()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn tabulated_quantiles_and_tails() {
        // Tables give these to all digits shown.
        assert_relative_eq!(normal_quantile(0.975), 1.959_963_984_540_054, epsilon = 1e-9);
        assert_relative_eq!(normal_quantile(0.9995), 3.290_526_731_491_926, epsilon = 1e-8);
        assert_relative_eq!(normal_quantile(0.2), -0.841_621_233_572_914, epsilon = 1e-9);
        assert_relative_eq!(fisher_tail(2.0, 10.0, 4.102_821), 0.05, epsilon = 1e-7);
        assert_relative_eq!(fisher_tail(1.0, 1.0, 1.0), 0.5, epsilon = 1e-12);
        assert_relative_eq!(fisher_tail(3.0, f64::INFINITY, 7.814_728 / 3.0), 0.05, epsilon = 1e-7);
        assert!(fisher_tail(1.0, 1e5, 1e4) < 1e-300);
        assert!(normal_quantile(1.0).is_nan() && fisher_tail(1.0, f64::NAN, 1.0).is_nan());
    }
}
