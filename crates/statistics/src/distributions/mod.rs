//! The distributions of test statistics.

mod special;

use special::{incomplete_beta, incomplete_gamma};

/// A distribution that a statistic has where the hypothesis holds. Values to about 12 digits, in both tails.
///
/// Outside its domain (degrees of freedom that are not positive, probabilities beyond 0 to 1) the answer is NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Distribution {
    /// Standard normal: a parameter or residual over its prior standard deviation.
    Normal,
    /// χ²: a sum of squares of `dof` standard normal values.
    ChiSquared {
        /// Degrees of freedom.
        dof: f64,
    },
    /// Student's t: a parameter over its posterior standard deviation.
    StudentT {
        /// Degrees of freedom of the variance.
        dof: f64,
    },
    /// Fisher's F: ratio of two variances.
    Fisher {
        /// Degrees of freedom of the numerator.
        numerator: f64,
        /// Degrees of freedom of the denominator.
        denominator: f64,
    },
    /// Pope's τ: a residual over its posterior standard deviation, which contains the residual itself \[Pope1976\]. More
    /// than one degree of freedom; values lie within ±√dof.
    Tau {
        /// Redundancy.
        dof: f64,
    },
}

impl Distribution {
    /// Probability of a value of at most `x`.
    pub fn cumulative(self, x: f64) -> f64 {
        self.tails(x).0
    }

    /// Probability of a value above `x`, exact where it is small.
    pub fn survival(self, x: f64) -> f64 {
        self.tails(x).1
    }

    /// Probability of a value that is larger in magnitude than `x`; for χ² and F, which have one tail, the survival.
    pub fn p_value(self, x: f64) -> f64 {
        if self.is_symmetric() { 2.0 * self.survival(x.abs()) } else { self.survival(x) }
    }

    /// The value that is exceeded with probability `level`: in magnitude where the distribution is symmetric.
    pub fn critical(self, level: f64) -> f64 {
        if self.is_symmetric() { self.upper_quantile(0.5 * level) } else { self.upper_quantile(level) }
    }

    /// The value that is not exceeded with probability `p`.
    pub fn quantile(self, p: f64) -> f64 {
        if self.is_symmetric() { -self.upper_quantile(p) } else { self.inverse(p, 1.0 - p) }
    }

    /// The value that is exceeded with probability `q`, exact where q is small.
    pub fn upper_quantile(self, q: f64) -> f64 {
        self.inverse(1.0 - q, q)
    }

    fn is_symmetric(self) -> bool {
        matches!(self, Self::Normal | Self::StudentT { .. } | Self::Tau { .. })
    }

    fn is_valid(self) -> bool {
        let good = |dof: f64| dof > 0.0 && dof.is_finite();
        match self {
            Self::Normal => true,
            Self::ChiSquared { dof } | Self::StudentT { dof } => good(dof),
            Self::Fisher { numerator, denominator } => good(numerator) && good(denominator),
            Self::Tau { dof } => good(dof - 1.0),
        }
    }

    /// Probabilities below and above x.
    fn tails(self, x: f64) -> (f64, f64) {
        if x.is_nan() || !self.is_valid() {
            return (f64::NAN, f64::NAN);
        }
        if !self.is_symmetric() {
            return self.positive_tails(x.max(0.0));
        }
        let half = 0.5 * self.positive_tails(x.abs()).1;
        if x < 0.0 { (half, 1.0 - half) } else { (1.0 - half, half) }
    }

    /// Probabilities below and above x >= 0, of the magnitude where the distribution is symmetric.
    fn positive_tails(self, x: f64) -> (f64, f64) {
        match self {
            Self::Normal => incomplete_gamma(0.5, 0.5 * x * x),
            Self::ChiSquared { dof } => incomplete_gamma(0.5 * dof, 0.5 * x),
            Self::StudentT { dof } => {
                let ratio = x * x / dof;
                incomplete_beta(0.5, 0.5 * dof, 1.0 / (1.0 + 1.0 / ratio), 1.0 / (1.0 + ratio))
            }
            Self::Fisher { numerator, denominator } => {
                let ratio = x * numerator / denominator;
                incomplete_beta(0.5 * numerator, 0.5 * denominator, 1.0 / (1.0 + 1.0 / ratio), 1.0 / (1.0 + ratio))
            }
            Self::Tau { dof } => {
                // τ² / dof is Beta(½, (dof − 1)/2).
                let share = (x * x / dof).min(1.0);
                incomplete_beta(0.5, 0.5 * (dof - 1.0), share, 1.0 - share)
            }
        }
    }

    /// The value with the probabilities `lower` and `upper` on its sides; the smaller of the two counts.
    fn inverse(self, lower: f64, upper: f64) -> f64 {
        let domain = 0.0..=1.0;
        if !self.is_valid() || !domain.contains(&lower) || !domain.contains(&upper) {
            return f64::NAN;
        }
        if !self.is_symmetric() {
            return self.positive_inverse(lower, upper);
        }
        let tail = 2.0 * lower.min(upper);
        let magnitude = self.positive_inverse(1.0 - tail, tail);
        if lower < upper { -magnitude } else { magnitude }
    }

    /// By bisection of ln x, which cannot fail; some 60 evaluations.
    fn positive_inverse(self, lower: f64, upper: f64) -> f64 {
        let largest = if let Self::Tau { dof } = self { dof.sqrt() } else { f64::INFINITY };
        if lower == 0.0 || upper == 0.0 {
            return if lower == 0.0 { 0.0 } else { largest };
        }
        let (mut low, mut high) = (-740.0_f64, largest.ln().min(709.0));
        while high - low > 4.0 * f64::EPSILON * low.abs().max(high.abs()).max(1.0) {
            let middle = 0.5 * (low + high);
            let (below, above) = self.positive_tails(middle.exp());
            if below.is_nan() {
                return f64::NAN;
            }
            let beyond = if lower < upper { below > lower } else { above < upper };
            if beyond {
                high = middle;
            } else {
                low = middle;
            }
        }
        (0.5 * (low + high)).exp()
    }
}

/// The value that a sum of squares of `dof` standard normal values exceeds with probability `level`: the limit of a test.
/// Infinite without freedom, a test that nothing fails.
pub fn chi_squared_limit(dof: f64, level: f64) -> f64 {
    if dof <= 0.0 { f64::INFINITY } else { Distribution::ChiSquared { dof }.upper_quantile(level) }
}
