//! Robust kernels: how much a residual counts.

/// Weight function of an M-estimator. `u` is the residual over its scale; the tuning constants give 95 % efficiency on
/// normally distributed residuals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum RobustKernel {
    /// Least squares: weight 1.
    None,
    /// Full weight up to 1.345, then c/|u|.
    Huber,
    /// Biweight: (1 − (u/4.685)²)², nothing beyond.
    Tukey,
    /// 1 / (1 + (u/2.385)²).
    Cauchy,
    /// 1 / (1 + (u/3.787)²)².
    GemanMcClure,
    /// exp(−(u/2.985)²).
    #[default]
    Welsch,
}

impl RobustKernel {
    /// The constant `c` of the kernel, in units of the scale: 95 % efficiency.
    fn tuning(self) -> f64 {
        match self {
            Self::None => f64::INFINITY,
            Self::Huber => 1.345,
            Self::Tukey => TUKEY,
            Self::Cauchy => 2.385,
            Self::GemanMcClure => 3.787,
            Self::Welsch => 2.985,
        }
    }

    /// Weight of a residual `u` (in units of the scale): between 0 and 1, 1 at 0.
    #[must_use]
    pub fn weight(self, u: f64) -> f64 {
        let c = self.tuning();
        let s = (u / c).powi(2);
        match self {
            Self::None => 1.0,
            Self::Huber => (c / u.abs()).min(1.0),
            Self::Tukey => (1.0 - s).max(0.0).powi(2),
            Self::Cauchy => 1.0 / (1.0 + s),
            Self::GemanMcClure => (1.0 + s).powi(-2),
            Self::Welsch => (-s).exp(),
        }
    }

    /// Slope of the influence function `u · weight(u)`: how much the estimating equations change with `u`.
    #[must_use]
    pub fn influence_slope(self, u: f64) -> f64 {
        let c = self.tuning();
        let s = (u / c).powi(2);
        match self {
            Self::None => 1.0,
            Self::Huber => f64::from(u8::from(u.abs() <= c)),
            Self::Tukey if s < 1.0 => (1.0 - s) * (1.0 - 5.0 * s),
            Self::Tukey => 0.0,
            Self::Cauchy => (1.0 - s) / (1.0 + s).powi(2),
            Self::GemanMcClure => (1.0 - 3.0 * s) / (1.0 + s).powi(3),
            Self::Welsch => (1.0 - 2.0 * s) * (-s).exp(),
        }
    }
}

/// Standard deviations from which on the biweight gives no weight: 95 % efficiency on normally distributed residuals.
pub const TUKEY: f64 = 4.685;

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [RobustKernel; 6] = [
        RobustKernel::None,
        RobustKernel::Huber,
        RobustKernel::Tukey,
        RobustKernel::Cauchy,
        RobustKernel::GemanMcClure,
        RobustKernel::Welsch,
    ];

    #[test]
    fn slope_is_the_difference_quotient_of_the_influence() {
        let h = 1e-6;
        for kernel in ALL {
            for u in [-6.0, -2.0, -0.3, 0.0, 0.7, 1.2, 3.0, 9.0] {
                let influence = |u: f64| if u == 0.0 { 0.0 } else { u * kernel.weight(u) };
                let quotient = (influence(u + h) - influence(u - h)) / (2.0 * h);
                // Central differences with h = 1e-6: error about 1e-10 from rounding.
                assert!((kernel.influence_slope(u) - quotient).abs() < 1e-8, "{kernel:?} at {u}");
            }
        }
    }

    #[test]
    fn tuning_gives_95_percent_efficiency() {
        for kernel in ALL.into_iter().skip(1) {
            let (mut slope, mut square) = (0.0, 0.0);
            for i in -8000..=8000 {
                let u = f64::from(i) * 1e-3;
                let density = (-u * u / 2.0).exp() / (2.0 * std::f64::consts::PI).sqrt() * 1e-3;
                slope += kernel.influence_slope(u) * density;
                square += (u * kernel.weight(u)).powi(2) * density * f64::from(u8::from(i != 0));
            }
            // Constants are rounded to four digits.
            assert!((slope * slope / square - 0.95).abs() < 5e-4, "{kernel:?}: {}", slope * slope / square);
        }
    }
}
