//! Range-error models as lists of named parameters, the form calibration files keep them in.

use crate::{AmplitudeHyperbola, Error, RangeErrorModel, RangeTerms, Result};

/// Canonical names and units of all parameters of a [`RangeErrorModel`], in the order they are written.
///
/// `amplitude` in a unit stands for the camera's own amplitude unit.
pub const PARAMETERS: [(&str, &str); 12] = [
    ("d0", "m"),
    ("d2", "m"),
    ("d3", "m"),
    ("d4", "m"),
    ("d5", "m"),
    ("d6", "m"),
    ("d7", "m"),
    ("e1", "m/mm"),
    ("e2", "m/mm"),
    ("h1", "1/amplitude"),
    ("h2", "1/(m*amplitude)"),
    ("h3", "1/m^2"),
];

/// Where the value of a parameter comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ParameterStatus {
    /// Estimated from observations.
    Estimated,
    /// Held at a given value.
    Held,
}

/// One parameter of a calibration with its quality.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct NamedParameter {
    /// Canonical name, one of [`PARAMETERS`].
    pub name: String,
    /// Value in [`Self::unit`].
    pub value: f64,
    /// Standard deviation in [`Self::unit`]: 0 for a held parameter, NaN where it is not known.
    pub sigma: f64,
    /// Unit of value and standard deviation, that of [`PARAMETERS`].
    pub unit: String,
    /// Whether it was estimated or held.
    pub status: ParameterStatus,
}

impl NamedParameter {
    /// A held parameter; refuses a name that is not one of [`PARAMETERS`].
    pub fn held(name: &str, value: f64) -> Result<Self> {
        let (name, unit) = known(name)?;
        Ok(Self { name: name.into(), value, sigma: 0.0, unit: unit.into(), status: ParameterStatus::Held })
    }

    /// An estimated parameter with its standard deviation; refuses a name that is not one of [`PARAMETERS`].
    pub fn estimated(name: &str, value: f64, sigma: f64) -> Result<Self> {
        Ok(Self { sigma, status: ParameterStatus::Estimated, ..Self::held(name, value)? })
    }

    /// Refuses an unknown name, a unit other than the canonical one, a value that is not finite and a
    /// negative or infinite standard deviation.
    pub fn validate(&self) -> Result<()> {
        let (name, unit) = known(&self.name)?;
        if self.unit != unit {
            return Err(Error::WrongUnit { name: self.name.clone(), found: self.unit.clone(), expected: unit });
        }
        crate::error::require_finite(name, self.value)?;
        if self.sigma < 0.0 || self.sigma.is_infinite() {
            return Err(Error::OutOfDomain {
                name,
                value: self.sigma,
                expected: "a standard deviation is not negative and not infinite",
            });
        }
        Ok(())
    }
}

impl RangeErrorModel {
    /// All parameters of the model as held ones: d0..e2, and h1..h3 where there is a hyperbola.
    ///
    /// The ambiguity interval and the spans are no parameters and stay behind.
    pub fn to_parameters(&self) -> Vec<NamedParameter> {
        let hyperbola = self.hyperbola.iter().flat_map(|h| [h.h1, h.h2, h.h3]);
        let values = self.terms.to_array().into_iter().chain(hyperbola);
        PARAMETERS
            .iter()
            .zip(values)
            .map(|((name, unit), value)| NamedParameter {
                name: (*name).into(),
                value,
                sigma: 0.0,
                unit: (*unit).into(),
                status: ParameterStatus::Held,
            })
            .collect()
    }

    /// The model with these parameters, in any order.
    ///
    /// A parameter that is missing is zero; without any of h1, h2, h3 there is no hyperbola, and with
    /// one of them `amplitude_span` must be given. Refuses an unknown or repeated name, a wrong unit and
    /// whatever [`RangeErrorModel::validate`] refuses.
    pub fn from_parameters(
        ambiguity_interval_m: f64,
        parameters: &[NamedParameter],
        amplitude_span: Option<[f64; 2]>,
        range_span_m: Option<[f64; 2]>,
    ) -> Result<Self> {
        for (index, parameter) in parameters.iter().enumerate() {
            parameter.validate()?;
            if parameters[..index].iter().any(|earlier| earlier.name == parameter.name) {
                return Err(Error::DuplicateParameter { name: parameter.name.clone() });
            }
        }
        let find = |name: &str| parameters.iter().find(|parameter| parameter.name == name);
        let value = |name: &str| find(name).map_or(0.0, |parameter| parameter.value);
        let hyperbola = if AmplitudeHyperbola::NAMES.iter().any(|name| find(name).is_some()) {
            let [h1, h2, h3] = AmplitudeHyperbola::NAMES.map(value);
            let amplitude_span = amplitude_span.ok_or(Error::MissingAmplitudeSpan)?;
            Some(AmplitudeHyperbola { h1, h2, h3, amplitude_span })
        } else {
            None
        };
        let terms = RangeTerms::from_array(RangeTerms::NAMES.map(value));
        let model = Self { ambiguity_interval_m, terms, hyperbola, range_span_m };
        model.validate()?;
        Ok(model)
    }
}

/// Canonical name and unit of a parameter.
fn known(name: &str) -> Result<(&'static str, &'static str)> {
    PARAMETERS.into_iter().find(|(known, _)| *known == name).ok_or_else(|| Error::UnknownParameter {
        name: name.into(),
        known: PARAMETERS.map(|(known, _)| known).join(", "),
    })
}
