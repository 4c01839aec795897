use crate::{Error, Result};

/// How much an observation may pull, depending on `s = √(vᵀC⁻¹v)` of its residual v (all its components together).
///
/// The objective is the sum of ρ(s²) over all observations, and each is weighted with `w = dρ/ds²` (iteratively
/// reweighted least squares). The parameter is a multiple of the standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum Kernel {
    /// ρ = s²: least squares.
    #[default]
    LeastSquares,
    /// ρ = s² up to `k`, then 2ks − k²; w = k/s. Convex. Usual: 1.345 \[Huber1981\].
    Huber(f64),
    /// ρ = c² ln(1 + s²/c²). Usual: 2.385.
    Cauchy(f64),
    /// ρ = c²/3 (1 − (1 − s²/c²)³) up to `c`, then constant: beyond, an observation has no weight at all. Needs a good
    /// start. Usual: 4.685.
    Tukey(f64),
    /// ρ = s² / (1 + s²/c²), w = 1/(1 + s²/c²)². Redescends; 3.787 has the efficiency of the others (95 %).
    GemanMcClure(f64),
}

impl Kernel {
    /// ρ(s²) and w(s²).
    #[inline]
    pub fn evaluate(self, square: f64) -> (f64, f64) {
        match self {
            Self::LeastSquares => (square, 1.0),
            Self::Huber(k) if square <= k * k => (square, 1.0),
            Self::Huber(k) => (2.0 * k * square.sqrt() - k * k, k / square.sqrt()),
            Self::Cauchy(c) => {
                let ratio = square / (c * c);
                (c * c * ratio.ln_1p(), 1.0 / (1.0 + ratio))
            }
            Self::Tukey(c) => {
                let rest = (1.0 - square / (c * c)).max(0.0);
                (c * c / 3.0 * (1.0 - rest.powi(3)), rest * rest)
            }
            Self::GemanMcClure(c) => {
                let factor = 1.0 / (1.0 + square / (c * c));
                (square * factor, factor * factor)
            }
        }
    }

    /// Checks the parameter.
    ///
    /// # Errors
    /// [`Error::Option`] where it is not positive.
    pub fn check(self) -> Result<()> {
        let (Self::Huber(value) | Self::Cauchy(value) | Self::Tukey(value) | Self::GemanMcClure(value)) = self else {
            return Ok(());
        };
        let good = value.is_finite() && value > 0.0;
        if good { Ok(()) } else { Err(Error::Option { name: "kernel", value, expected: "a positive number" }) }
    }
}
