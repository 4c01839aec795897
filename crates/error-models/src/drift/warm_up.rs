//! Drift of all ranges while the camera warms up, and with its temperature (Sect. 4.7).

use nalgebra::DMatrix;

use crate::error::{require_finite, require_span};
use crate::{Error, FrameRateDrift, Result};

/// A drift that all pixels and frequencies share: it is **subtracted** from every range, as d0 is.
///
/// `Δρ(t, T) = Σ A_i exp(−t / τ_i) + c_T (T − T_0) + u(t)`, t the time since power-on, T the camera's temperature, and u
/// what follows the frame rate ([`FrameRateDrift`]). Without end it is zero at `T = T_0` and the reference rate: the
/// offset d0 of a calibration belongs to the warm camera.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct WarmUp {
    /// What dies out after power-on.
    pub transients: Vec<Transient>,
    /// What follows the temperature.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub temperature: Option<TemperatureDrift>,
    /// What follows the frame rate.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub frame_rate: Option<FrameRateDrift>,
    /// Times since power-on that the transients were fitted in, second; `None` where they hold at all times.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub time_span_s: Option<[f64; 2]>,
}

/// One exponential of a drift.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Transient {
    /// A, its value at power-on, metre.
    pub amplitude_m: f64,
    /// τ, the time in which it falls to 1/e, second.
    pub time_constant_s: f64,
}

/// The part of a drift that is proportional to the temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct TemperatureDrift {
    /// `c_T`, metre per kelvin.
    pub coefficient_m_per_k: f64,
    /// `T_0`, the temperature of the warm camera, degree Celsius.
    pub reference_c: f64,
    /// Temperatures it was fitted in, degree Celsius; `None` where it holds at all.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub span_c: Option<[f64; 2]>,
}

impl WarmUp {
    /// Time constants after which a transient counts as decayed: 5 % of it are left. Beyond the end of its span a
    /// transient is continued only then.
    pub const DECAYED: f64 = 3.0;

    /// Whether there is nothing that drifts.
    pub fn is_empty(&self) -> bool {
        self.transients.is_empty() && self.temperature.is_none() && self.frame_rate.is_none()
    }

    /// Names of the parameters in the order of [`Self::jacobian`]: `A1, tau1, A2, tau2, ..` (m, s), `cT` (m/K),
    /// `cF, tauF` (m/Hz, s).
    pub fn parameter_names(&self) -> Vec<String> {
        let transients = (1..=self.transients.len()).flat_map(|number| [format!("A{number}"), format!("tau{number}")]);
        let rate = self.frame_rate.iter().flat_map(|_| ["cF".to_owned(), "tauF".to_owned()]);
        transients.chain(self.temperature.map(|_| "cT".to_owned())).chain(rate).collect()
    }

    /// Values of [`Self::parameter_names`].
    pub fn parameter_values(&self) -> Vec<f64> {
        let transients = self.transients.iter().flat_map(|part| [part.amplitude_m, part.time_constant_s]);
        let rate = self.frame_rate.iter().flat_map(|part| [part.coefficient_m_per_hz, part.time_constant_s]);
        transients.chain(self.temperature.map(|part| part.coefficient_m_per_k)).chain(rate).collect()
    }

    /// Unit of a parameter by its name; `None` if there is no such parameter.
    pub fn parameter_unit(name: &str) -> Option<&'static str> {
        let numbered = |prefix: &str| {
            let digits = name.strip_prefix(prefix)?;
            digits.parse::<u8>().ok().filter(|number| *number > 0 && number.to_string() == digits)
        };
        match name {
            "cT" => Some("m/K"),
            "cF" => Some("m/Hz"),
            "tauF" => Some("s"),
            _ if numbered("A").is_some() => Some("m"),
            _ if numbered("tau").is_some() => Some("s"),
            _ => None,
        }
    }

    /// The drift, metre, `time_s` after power-on at a temperature of the camera.
    ///
    /// The temperature does not matter where the model has none, nor the time where it has no transients.
    ///
    /// # Errors
    /// [`Error::OutsideDriftSpan`] where the model says nothing: a time before the span, or behind it unless all
    /// transients have decayed there; a temperature outside its span. [`Error::MissingForDrift`] where the model needs
    /// a time or a temperature that is not known, or follows the frame rate ([`Self::value_at_rates`]).
    pub fn value(&self, time_s: Option<f64>, temperature_c: Option<f64>) -> Result<f64> {
        self.value_at_rates(time_s, temperature_c, None)
    }

    pub(crate) fn value_without_rate(&self, time_s: Option<f64>, temperature_c: Option<f64>) -> Result<f64> {
        let (time_s, temperature_c) = self.arguments(time_s, temperature_c)?;
        let transients: f64 = self.transients.iter().map(|part| part.value(time_s)).sum();
        Ok(transients + self.temperature.map_or(0.0, |part| part.value(temperature_c)))
    }

    /// `∂Δρ` by [`Self::parameter_names`]; errors as of [`Self::value`].
    pub fn jacobian(&self, time_s: Option<f64>, temperature_c: Option<f64>) -> Result<Vec<f64>> {
        self.jacobian_at_rates(time_s, temperature_c, None)
    }

    pub(crate) fn jacobian_without_rate(&self, time_s: Option<f64>, temperature_c: Option<f64>) -> Result<Vec<f64>> {
        let (time_s, temperature_c) = self.arguments(time_s, temperature_c)?;
        let transients = self.transients.iter().flat_map(|part| part.jacobian(time_s));
        Ok(transients.chain(self.temperature.map(|part| temperature_c - part.reference_c)).collect())
    }

    /// Standard deviation of [`Self::value`], metre, from the covariance matrix of [`Self::parameter_names`].
    pub fn sigma_m(&self, time_s: Option<f64>, temperature_c: Option<f64>, covariance: &DMatrix<f64>) -> Result<f64> {
        Self::sigma_of(self.jacobian(time_s, temperature_c)?, covariance)
    }

    /// Standard deviation of a value with these derivatives by [`Self::parameter_names`].
    pub fn sigma_of(row: Vec<f64>, covariance: &DMatrix<f64>) -> Result<f64> {
        if covariance.shape() != (row.len(), row.len()) {
            let (name, found) = ("rows of the covariance matrix of the drift", covariance.nrows());
            return Err(Error::WrongLength { name, found, expected: row.len() });
        }
        let row = nalgebra::DVector::from_vec(row);
        Ok(row.dot(&(covariance * &row)).max(0.0).sqrt())
    }

    /// Time and temperature as far as the model needs them; zero where it does not.
    fn arguments(&self, time_s: Option<f64>, temperature_c: Option<f64>) -> Result<(f64, f64)> {
        let time_s = if self.transients.is_empty() {
            0.0
        } else {
            let time_s = time_s.ok_or(Error::MissingForDrift { name: "time since power-on" })?;
            self.require_time(time_s)?;
            time_s
        };
        let temperature_c = match &self.temperature {
            None => 0.0,
            Some(part) => {
                let value = temperature_c.ok_or(Error::MissingForDrift { name: "temperature" })?;
                let span = part.span_c.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
                if !(value.is_finite() && value >= span[0] && value <= span[1]) {
                    return Err(Error::OutsideDriftSpan { name: "temperature", unit: "°C", value, span });
                }
                value
            }
        };
        Ok((time_s, temperature_c))
    }

    fn require_time(&self, value: f64) -> Result<()> {
        let span = self.time_span_s.unwrap_or([0.0, f64::INFINITY]);
        let decayed = || self.transients.iter().all(|part| span[1] >= Self::DECAYED * part.time_constant_s);
        if value.is_finite() && value >= span[0] && (value <= span[1] || decayed()) {
            return Ok(());
        }
        Err(Error::OutsideDriftSpan { name: "time since power-on", unit: "s", value, span })
    }

    /// Largest time constant, second; `None` without transients and a part that follows the frame rate.
    pub fn longest_time_constant_s(&self) -> Option<f64> {
        let rate = self.frame_rate.iter().map(|part| part.time_constant_s);
        self.transients.iter().map(|part| part.time_constant_s).chain(rate).max_by(f64::total_cmp)
    }

    /// The time since power-on from which on the transients stay within `tolerance_m` of zero; 0 where they always do.
    pub fn settling_time_s(&self, tolerance_m: f64) -> f64 {
        let transients = |time_s: f64| self.transients.iter().map(|part| part.value(time_s)).sum::<f64>();
        // No transient is outside the tolerance any more where the sum of their sizes is within it.
        let bound = |time_s: f64| self.transients.iter().map(|part| part.value(time_s).abs()).sum::<f64>();
        let Some(longest) = self.longest_time_constant_s() else { return 0.0 };
        let mut end = 0.0;
        while bound(end) > tolerance_m.max(f64::MIN_POSITIVE) {
            end += longest;
        }
        // The last time outside: a coarse search from the end, then halving.
        let step = end / SETTLING_STEPS as f64;
        let outside = (0..=SETTLING_STEPS).rev().map(|index| index as f64 * step);
        let Some(mut low) = outside.into_iter().find(|time_s| transients(*time_s).abs() > tolerance_m) else {
            return 0.0;
        };
        let mut high = low + step;
        while high - low > 1e-6 * longest {
            let middle = 0.5 * (low + high);
            if transients(middle).abs() > tolerance_m { low = middle } else { high = middle }
        }
        high
    }

    /// Refuses values that are not finite, time constants that are not positive, and bad spans.
    pub fn validate(&self) -> Result<()> {
        for part in &self.transients {
            require_finite("amplitude_m of a transient", part.amplitude_m)?;
            require_time_constant(part.time_constant_s)?;
        }
        if let Some(part) = &self.temperature {
            require_finite("coefficient_m_per_k", part.coefficient_m_per_k)?;
            require_finite("reference_c", part.reference_c)?;
            part.span_c.map_or(Ok(()), |span| require_span("span_c", span))?;
        }
        self.frame_rate.map_or(Ok(()), |part| part.validate())?;
        self.time_span_s.map_or(Ok(()), |span| require_span("time_span_s", span))
    }
}

pub(crate) fn require_time_constant(value: f64) -> Result<()> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    let expected = "a time constant is positive and finite";
    Err(Error::OutOfDomain { name: "time_constant_s", value, expected })
}

/// Steps of the search for the time from which on a drift stays small.
const SETTLING_STEPS: usize = 4096;

impl Transient {
    /// `A exp(−t / τ)`, metre.
    pub fn value(&self, time_s: f64) -> f64 {
        self.amplitude_m * (-time_s / self.time_constant_s).exp()
    }

    /// `∂` of [`Self::value`] by A and τ.
    pub fn jacobian(&self, time_s: f64) -> [f64; 2] {
        let decay = (-time_s / self.time_constant_s).exp();
        [decay, self.amplitude_m * decay * time_s / (self.time_constant_s * self.time_constant_s)]
    }
}

impl TemperatureDrift {
    /// `c_T (T − T_0)`, metre.
    pub fn value(&self, temperature_c: f64) -> f64 {
        self.coefficient_m_per_k * (temperature_c - self.reference_c)
    }
}
