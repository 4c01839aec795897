//! Samples of a drift whose truth is known.
#![allow(dead_code)]

use error_models::{TemperatureDrift, Transient, WarmUp};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use warm_up::DriftSample;

/// Five hours, as in Fig. 5 of the chapter.
pub const DURATION_S: f64 = 18_000.0;

pub fn transients(parts: &[(f64, f64)]) -> WarmUp {
    let part = |&(amplitude_m, time_constant_s): &(f64, f64)| Transient { amplitude_m, time_constant_s };
    WarmUp { transients: parts.iter().map(part).collect(), ..WarmUp::default() }
}

/// A camera that warms up, in the conditions of a capture.
pub struct Capture {
    pub truth: WarmUp,
    pub count: usize,
    pub start_s: f64,
    pub duration_s: f64,
    pub sigma_m: f64,
    /// Correlation of the noise from one sample to the next.
    pub correlation: f64,
    pub temperature_c: fn(f64) -> Option<f64>,
}

impl Capture {
    pub fn new(truth: WarmUp) -> Self {
        let temperature_c = |_| None;
        Self {
            truth,
            count: 1000,
            start_s: 20.0,
            duration_s: DURATION_S,
            sigma_m: 2e-4,
            correlation: 0.0,
            temperature_c,
        }
    }

    pub fn samples(&self, seed: u64) -> Vec<DriftSample> {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let mut error = normal();
        let mut one = |index: usize| {
            let time_s = self.start_s + self.duration_s * index as f64 / (self.count - 1) as f64;
            let temperature_c = (self.temperature_c)(time_s);
            error = self.correlation * error + (1.0 - self.correlation.powi(2)).sqrt() * normal();
            let drift = self.truth.value(Some(time_s), temperature_c).unwrap();
            // A scene somewhere, and a sigma that is wrong by a factor.
            let mean_change_m = 0.37 + drift + self.sigma_m * error;
            DriftSample { time_s, mean_change_m, sigma_m: 0.1 * self.sigma_m, temperature_c }
        };
        (0..self.count).map(&mut one).collect()
    }
}

/// A drift that follows the temperature beside one transient.
pub fn with_temperature() -> WarmUp {
    let temperature = TemperatureDrift { coefficient_m_per_k: 3e-4, reference_c: 40.0, span_c: None };
    WarmUp { temperature: Some(temperature), ..transients(&[(-0.003, 1200.0)]) }
}

/// Warms up by 15 K, and the room has its own ways.
pub fn room_temperature_c(time_s: f64) -> f64 {
    40.0 - 15.0 * (-time_s / 1500.0).exp() + 2.0 * (time_s / 1700.0).sin()
}
