//! Incomplete gamma and beta functions. Their leading factors are densities in Loader's saddle-point form
//! \[Loader2000\], which stays exact for any size of the arguments; series and continued fractions as in \[DLMF\], 8 and 17.

use std::f64::consts::PI;

/// Terms after which a series or a fraction is given up; the number needed grows with the root of the parameters.
const TERMS: usize = 200_000;

/// `ln Γ(a+1) − (a+½) ln a + a − ½ ln 2π`, what Stirling's formula misses, for a > 0.
fn stirling_error(a: f64) -> f64 {
    let (mut shifted, mut sum) = (a, 0.0);
    while shifted < 16.0 {
        sum += (shifted + 0.5) * (1.0 / shifted).ln_1p() - 1.0;
        shifted += 1.0;
    }
    // Bernoulli numbers; at 16 the first term left out is 1e-17.
    let square = shifted * shifted;
    let series = [1.0 / 156.0, -691.0 / 360_360.0, 1.0 / 1188.0, -1.0 / 1680.0, 1.0 / 1260.0, -1.0 / 360.0, 1.0 / 12.0];
    sum + series.iter().fold(0.0, |value, term| value / square + term) / shifted
}

/// `a ln(a/x) + x − a`, never negative, without cancellation where x is close to a.
fn deviance(a: f64, x: f64) -> f64 {
    let t = (x - a) / a;
    if t.abs() > 0.1 {
        return a * (t - (x / a).ln());
    }
    // With s = t/(2+t): ln(1+t) = 2 (s + s³/3 + s⁵/5 …) and t − 2s = s t. At |s| = 0.053 nine terms leave 1e-24.
    let s = t / (2.0 + t);
    let square = s * s;
    let series = (1..10).rev().fold(0.0, |value, n| value * square + 1.0 / f64::from(2 * n + 1));
    a * (s * t - 2.0 * s * square * series)
}

/// `xᵃ e⁻ˣ / Γ(a+1)`.
fn poisson_density(a: f64, x: f64) -> f64 {
    (-stirling_error(a) - deviance(a, x)).exp() / (2.0 * PI * a).sqrt()
}

/// Regularised incomplete gamma functions P(a, x) and Q(a, x) = 1 − P for a > 0, x ≥ 0; NaN where they do not converge.
pub(super) fn incomplete_gamma(a: f64, x: f64) -> (f64, f64) {
    if x == 0.0 {
        return (0.0, 1.0);
    }
    if x == f64::INFINITY {
        return (1.0, 0.0);
    }
    let density = poisson_density(a, x);
    if x < a + 1.0 {
        let lower = density * gamma_series(a, x);
        (lower, 1.0 - lower)
    } else {
        let upper = a * density * gamma_fraction(a, x);
        (1.0 - upper, upper)
    }
}

/// `Σ xⁿ / ((a+1) … (a+n))`.
fn gamma_series(a: f64, x: f64) -> f64 {
    let (mut term, mut sum) = (1.0, 1.0);
    for n in 1..TERMS {
        term *= x / (a + n as f64);
        sum += term;
        if term < f64::EPSILON * sum * 0.1 {
            return sum;
        }
    }
    f64::NAN
}

/// `1/(x+1−a − 1(1−a)/(x+3−a − 2(2−a)/(x+5−a − …)))`.
fn gamma_fraction(a: f64, x: f64) -> f64 {
    let mut base = x + 1.0 - a;
    let mut lentz = Lentz::new(base);
    for n in 1..TERMS {
        let n = n as f64;
        base += 2.0;
        if lentz.extend(n * (a - n), base) {
            return 1.0 / lentz.value;
        }
    }
    f64::NAN
}

/// Regularised incomplete beta functions `I_x(a, b)` and 1 − `I_x(a, b)` for a, b > 0 and x + y = 1, both given so that
/// neither loses digits.
pub(super) fn incomplete_beta(a: f64, b: f64, x: f64, y: f64) -> (f64, f64) {
    if x <= 0.0 {
        return (0.0, 1.0);
    }
    if y <= 0.0 {
        return (1.0, 0.0);
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        let (upper, lower) = incomplete_beta_below(b, a, y, x);
        return (lower, upper);
    }
    incomplete_beta_below(a, b, x, y)
}

/// The same for x below the mean, where the fraction converges fast.
fn incomplete_beta_below(a: f64, b: f64, x: f64, y: f64) -> (f64, f64) {
    let n = a + b;
    let exponent = stirling_error(n) - stirling_error(a) - stirling_error(b) - deviance(a, n * x) - deviance(b, n * y);
    let binomial_density = exponent.exp() * (n / (2.0 * PI * a * b)).sqrt();
    let lower = binomial_density * b / n * beta_fraction(a, b, x);
    (lower, 1.0 - lower)
}

/// `1/(1 + d₁/(1 + d₂/(1 + …)))`, DLMF 8.17.22.
fn beta_fraction(a: f64, b: f64, x: f64) -> f64 {
    let mut lentz = Lentz::new(1.0);
    for m in 0..TERMS {
        let m = m as f64;
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        lentz.extend(odd, 1.0);
        let m = m + 1.0;
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        if lentz.extend(even, 1.0) {
            return 1.0 / lentz.value;
        }
    }
    f64::NAN
}

/// A continued fraction from its front, after Lentz, Thompson and Barnett.
struct Lentz {
    value: f64,
    c: f64,
    d: f64,
}

impl Lentz {
    fn new(first: f64) -> Self {
        let first = Self::nonzero(first);
        Self { value: first, c: first, d: 0.0 }
    }

    /// Adds `numerator / (base + …)`; true where nothing changes any more.
    fn extend(&mut self, numerator: f64, base: f64) -> bool {
        self.d = 1.0 / Self::nonzero(base + numerator * self.d);
        self.c = Self::nonzero(base + numerator / self.c);
        let factor = self.c * self.d;
        self.value *= factor;
        (factor - 1.0).abs() < f64::EPSILON
    }

    fn nonzero(value: f64) -> f64 {
        if value.abs() < 1e-300 { 1e-300 } else { value }
    }
}
