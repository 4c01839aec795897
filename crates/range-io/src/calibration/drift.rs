use error_models::{NamedParameter, ParameterStatus, WarmUp};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::check::require;
use super::correlation::{Correlation, ROUNDING, covariance};
use crate::{InvalidField, Result};

/// The drift of a warming camera (Sect. 4.7) with its quality.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CalibratedDrift {
    /// The drift by time since power-on, temperature and frame rate.
    pub model: WarmUp,
    /// Standard deviations in the order and the units of [`WarmUp::parameter_names`]; zero where a value is held.
    pub deviations: Vec<f64>,
    /// Correlations by [`WarmUp::parameter_names`]; without it they count as uncorrelated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correlation: Option<Correlation>,
}

impl CalibratedDrift {
    /// The parameters by [`WarmUp::parameter_names`], as far as values and deviations go.
    pub fn parameters(&self) -> Vec<NamedParameter> {
        let values = self.model.parameter_values().into_iter().zip(self.deviations.iter().copied());
        let named = self.model.parameter_names().into_iter().zip(values);
        let parameter = |(name, (value, sigma)): (String, (f64, f64))| {
            let unit = WarmUp::parameter_unit(&name).unwrap_or_default().to_owned();
            let status = if sigma > 0.0 { ParameterStatus::Estimated } else { ParameterStatus::Held };
            NamedParameter { name, value, sigma, unit, status }
        };
        named.map(parameter).collect()
    }

    /// Covariance matrix by [`WarmUp::parameter_names`], in the squares and products of their units.
    ///
    /// Refuses what the check of the file refuses.
    pub fn covariance(&self) -> Result<DMatrix<f64>> {
        self.check("warm_up").map_err(|invalid| invalid.in_memory("calibration"))?;
        let names = self.model.parameter_names();
        let known: Vec<(String, f64)> = names.iter().cloned().zip(self.deviations.iter().copied()).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        Ok(covariance(&names, &known, self.correlation.as_ref()))
    }

    pub(super) fn check(&self, path: &str) -> std::result::Result<(), InvalidField> {
        let model = format!("{path}.model");
        require(!self.model.is_empty(), &model, || {
            "has neither a transient nor a temperature nor a frame rate, expected one".into()
        })?;
        self.model.validate().map_err(|error| InvalidField::new(model, error.to_string()))?;
        let names = self.model.parameter_names();
        let (found, expected) = (self.deviations.len(), names.len());
        require(found == expected, format!("{path}.deviations"), || {
            format!("has {found} values, expected {expected}: {}", names.join(", "))
        })?;
        for (index, (name, sigma)) in names.iter().zip(&self.deviations).enumerate() {
            require(sigma.is_finite() && *sigma >= 0.0, format!("{path}.deviations[{index}]"), || {
                format!("standard deviation of `{name}` is {sigma}, expected a finite number that is not negative")
            })?;
        }
        let Some(correlation) = &self.correlation else { return Ok(()) };
        let field = format!("{path}.correlation");
        correlation.check(&field, &names)?;
        // A matrix with a negative eigenvalue belongs to no random numbers: some sum would have a negative variance.
        let size = correlation.names.len();
        let matrix = DMatrix::from_fn(size, size, |i, j| correlation.matrix[i][j]);
        let least = matrix.symmetric_eigenvalues().iter().copied().fold(f64::INFINITY, f64::min);
        require(least >= -ROUNDING * size as f64, format!("{field}.matrix"), || {
            format!("has the eigenvalue {least}, expected none that is negative")
        })
    }
}
