//! Eq. 15: the range error that depends on the recorded amplitude.

use crate::error::{require_finite, require_span};
use crate::{AmplitudeHyperbola, Error, Result};

/// First derivatives of the amplitude-related correction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HyperbolaJacobian {
    /// With respect to h1, h2, h3.
    pub coefficients: [f64; 3],
    /// With respect to the amplitude, metre per amplitude unit.
    pub amplitude: f64,
}

impl AmplitudeHyperbola {
    /// Names of the coefficients.
    pub const NAMES: [&'static str; 3] = ["h1", "h2", "h3"];

    /// `Δρ` of Eq. 15 in metre.
    ///
    /// `None` where the amplitude is outside [`Self::amplitude_span`] (bounds belong to it), NaN, or
    /// where the radicand is negative: the model says nothing there and is not extrapolated.
    pub fn correction(&self, amplitude: f64) -> Option<f64> {
        if !self.in_span(amplitude) {
            return None;
        }
        let linear = self.h2 / self.h3 * amplitude;
        let rest = (1.0 - 2.0 * self.h1 * amplitude) / self.h3;
        let radicand = linear * linear + rest;
        if !(radicand >= 0.0 && radicand.is_finite()) {
            return None;
        }
        let root = radicand.sqrt();
        // The same value written without the difference of two large numbers.
        Some(if linear > 0.0 { rest / (linear + root) } else { root - linear })
    }

    /// Derivatives of [`Self::correction`]; `None` where that is `None`, and at a vanishing radicand,
    /// where the slope is infinite.
    pub fn jacobian(&self, amplitude: f64) -> Option<HyperbolaJacobian> {
        let value = self.correction(amplitude)?;
        // Eq. 15 solves h3 Δρ² + 2 h2 a Δρ + 2 h1 a - 1 = 0; its implicit derivatives need one division.
        let denominator = 2.0 * (self.h3 * value + self.h2 * amplitude);
        let jacobian = HyperbolaJacobian {
            coefficients: [
                -2.0 * amplitude / denominator,
                -2.0 * amplitude * value / denominator,
                -value * value / denominator,
            ],
            amplitude: -2.0 * (self.h2 * value + self.h1) / denominator,
        };
        let finite = jacobian.amplitude.is_finite() && jacobian.coefficients.iter().all(|d| d.is_finite());
        finite.then_some(jacobian)
    }

    /// Smallest radicand of Eq. 15 over the amplitude span, square metre: not negative where Eq. 15 is real everywhere.
    pub fn least_radicand(&self) -> f64 {
        let [low, high] = self.amplitude_span;
        let slope = self.h2 / self.h3;
        let radicand = |amplitude: f64| (slope * amplitude).powi(2) + (1.0 - 2.0 * self.h1 * amplitude) / self.h3;
        // A parabola: its ends, and its lowest point where that is inside.
        let lowest = self.h1 / self.h3 / (slope * slope);
        let inside = if lowest > low && lowest < high { radicand(lowest) } else { f64::INFINITY };
        radicand(low).min(radicand(high)).min(inside)
    }

    /// Whether the amplitude lies in the span of the fit.
    pub fn in_span(&self, amplitude: f64) -> bool {
        (self.amplitude_span[0]..=self.amplitude_span[1]).contains(&amplitude)
    }

    /// Refuses coefficients that are not finite, `h3 = 0` (Eq. 15 divides by it) and a bad span.
    pub fn validate(&self) -> Result<()> {
        for (name, value) in Self::NAMES.into_iter().zip([self.h1, self.h2, self.h3]) {
            require_finite(name, value)?;
        }
        let ratios = [1.0 / self.h3, self.h2 / self.h3, self.h1 / self.h3];
        if !ratios.iter().all(|ratio| ratio.is_finite()) {
            return Err(Error::OutOfDomain { name: "h3", value: self.h3, expected: "Eq. 15 divides by h3" });
        }
        require_span("amplitude_span", self.amplitude_span)
    }
}
