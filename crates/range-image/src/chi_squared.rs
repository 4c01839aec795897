//! Quantiles of the chi-squared distribution, with degrees of freedom that need not be whole numbers.

/// The value that a chi-squared variable of `degrees` of freedom exceeds with the given probability (0 to 1, exclusive);
/// infinite without freedom: the threshold of a test that nothing can fail.
pub fn chi_squared_upper_quantile(degrees: f64, probability: f64) -> f64 {
    if degrees <= 0.0 {
        return f64::INFINITY;
    }
    let shape = degrees / 2.0;
    let (mut low, mut high) = (0.0, 1.0);
    while upper_tail(shape, high) > probability && high < 1e6 {
        high *= 2.0;
    }
    // Sixty halvings of the bracket reach the resolution of double precision.
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        if upper_tail(shape, middle) > probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    low + high
}

/// Regularised incomplete gamma function `Q(a, x)` (`[NumericalRecipes]`, Sect. 6.2): series below the mean, continued
/// fraction above it.
fn upper_tail(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 { 1.0 - front * series(a, x) } else { front * continued_fraction(a, x) }
}

/// `sum x^k / (a (a + 1) .. (a + k))`.
fn series(a: f64, x: f64) -> f64 {
    let (mut term, mut sum) = (1.0 / a, 1.0 / a);
    for k in 1..1000 {
        term *= x / (a + f64::from(k));
        sum += term;
        if term < sum * f64::EPSILON {
            break;
        }
    }
    sum
}

/// `1 / (x + 1 - a - 1 (1 - a) / (x + 3 - a - ..))` by Lentz's method.
fn continued_fraction(a: f64, x: f64) -> f64 {
    let mut denominator = x + 1.0 - a;
    let mut c = 1.0 / f64::MIN_POSITIVE;
    let mut d = 1.0 / denominator;
    let mut value = d;
    for k in 1..1000 {
        let numerator = f64::from(k) * (a - f64::from(k));
        denominator += 2.0;
        d = 1.0 / (numerator * d + denominator);
        c = denominator + numerator / c;
        value *= c * d;
        if (c * d - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    value
}

/// Logarithm of the gamma function: Stirling's series, to which small arguments are brought by the recursion.
fn ln_gamma(x: f64) -> f64 {
    let (mut x, mut shift) = (x, 0.0);
    while x < 10.0 {
        shift += x.ln();
        x += 1.0;
    }
    let square = 1.0 / (x * x);
    let correction = (1.0 / 12.0 - square * (1.0 / 360.0 - square * (1.0 / 1260.0 - square / 1680.0))) / x;
    (x - 0.5) * x.ln() - x + 0.5 * std::f64::consts::TAU.ln() + correction - shift
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        // R: qchisq(p, df, lower.tail = FALSE); df = 2 is -2 ln p.
        for (degrees, probability, expected) in [
            (1.0, 0.05, 3.841_458_820_694_124),
            (1.0, 1e-3, 10.827_566_170_662_733),
            (2.0, 1e-4, 18.420_680_743_952_367),
            (5.0, 0.01, 15.086_272_469_388_99),
            (9.0, 0.001, 27.877_164_871_256_57),
            (100.0, 0.05, 124.342_113_404_004_1),
        ] {
            let found = chi_squared_upper_quantile(degrees, probability);
            // Functions and quantiles are good to some 1e-12.
            assert!((found / expected - 1.0).abs() < 1e-10, "{degrees}, {probability}: {found}");
        }
    }

    #[test]
    fn degrees_between_whole_numbers_lie_between() {
        let [four, between, five] = [4.0, 4.3, 5.0].map(|degrees| chi_squared_upper_quantile(degrees, 1e-3));
        assert!(four < between && between < five);
    }
}
