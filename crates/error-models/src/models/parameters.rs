//! Range-error models as lists of named parameters, the form calibration files keep them in.

use crate::{
    AmplitudeHyperbola, Error, FurtherShape, FurtherTerms, ImageSurface, PeriodicSpline, RangeErrorModel,
    RangePolynomial, RangeTerms, Result,
};

/// Canonical names and units of the parameters of Eqs. 14 and 15, in the order they are written; for those of further
/// terms see [`parameter_unit`].
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
    /// Canonical name, one that [`parameter_unit`] knows.
    pub name: String,
    /// Value in [`Self::unit`].
    pub value: f64,
    /// Standard deviation in [`Self::unit`]: 0 for a held parameter, NaN where it is not known.
    pub sigma: f64,
    /// Unit of value and standard deviation, that of [`parameter_unit`].
    pub unit: String,
    /// Whether it was estimated or held.
    pub status: ParameterStatus,
}

impl NamedParameter {
    /// A held parameter; refuses a name that [`parameter_unit`] does not know.
    pub fn held(name: &str, value: f64) -> Result<Self> {
        let unit = known(name)?;
        Ok(Self { name: name.into(), value, sigma: 0.0, unit: unit.into(), status: ParameterStatus::Held })
    }

    /// An estimated parameter with its standard deviation; refuses a name that [`parameter_unit`] does not know.
    pub fn estimated(name: &str, value: f64, sigma: f64) -> Result<Self> {
        Ok(Self { sigma, status: ParameterStatus::Estimated, ..Self::held(name, value)? })
    }

    /// Refuses an unknown name, a unit other than the canonical one, a value that is not finite and a
    /// negative or infinite standard deviation.
    pub fn validate(&self) -> Result<()> {
        let unit = known(&self.name)?;
        let name =
            PARAMETERS.iter().find(|(name, _)| *name == self.name).map_or("further coefficient", |(name, _)| name);
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

/// All of a model but its parameters: what a list of them needs beside it to become a model again.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ModelShape {
    /// Amplitudes the hyperbola was fitted in.
    pub amplitude_span: Option<[f64; 2]>,
    /// Ranges the model was fitted in, metre.
    pub range_span_m: Option<[f64; 2]>,
    /// Spline, polynomial and surface.
    pub further: FurtherShape,
}

impl RangeErrorModel {
    /// All parameters of the model as held ones: those of [`Self::parameter_names`], and h1..h3 where there is a
    /// hyperbola.
    ///
    /// The ambiguity interval, the spans and the shape are no parameters and stay behind.
    pub fn to_parameters(&self) -> Vec<NamedParameter> {
        let linear = self.parameter_names().into_iter().zip(self.parameter_values());
        let hyperbola = self.hyperbola.iter().flat_map(|h| [h.h1, h.h2, h.h3]);
        let all = linear.chain(AmplitudeHyperbola::NAMES.map(str::to_owned).into_iter().zip(hyperbola));
        let held = |(name, value): (String, f64)| {
            let unit = parameter_unit(&name).unwrap_or_default().into();
            NamedParameter { name, value, sigma: 0.0, unit, status: ParameterStatus::Held }
        };
        all.map(held).collect()
    }

    /// Spans, spline, polynomial and surface of the model, without coefficients.
    pub fn shape(&self) -> ModelShape {
        ModelShape {
            amplitude_span: self.hyperbola.map(|hyperbola| hyperbola.amplitude_span),
            range_span_m: self.range_span_m,
            further: self.further.shape(),
        }
    }

    /// The model of Eqs. 14 and 15 with these parameters; see [`Self::from_shape`].
    pub fn from_parameters(
        ambiguity_interval_m: f64,
        parameters: &[NamedParameter],
        amplitude_span: Option<[f64; 2]>,
        range_span_m: Option<[f64; 2]>,
    ) -> Result<Self> {
        let shape = ModelShape { amplitude_span, range_span_m, further: FurtherShape::default() };
        Self::from_shape(ambiguity_interval_m, parameters, &shape)
    }

    /// The model with this shape and these parameters, in any order.
    ///
    /// A parameter that is missing is zero; without any of h1, h2, h3 there is no hyperbola, and with
    /// one of them `amplitude_span` must be given. Refuses an unknown or repeated name, a wrong unit, coefficients that
    /// the shape does not have, and whatever [`RangeErrorModel::validate`] refuses.
    pub fn from_shape(ambiguity_interval_m: f64, parameters: &[NamedParameter], shape: &ModelShape) -> Result<Self> {
        let mut model = Self {
            terms: RangeTerms::default(),
            range_span_m: shape.range_span_m,
            further: FurtherTerms::zero(&shape.further)?,
            ..Self::error_free(ambiguity_interval_m)
        };
        let names = model.parameter_names();
        for (index, parameter) in parameters.iter().enumerate() {
            parameter.validate()?;
            if parameters[..index].iter().any(|earlier| earlier.name == parameter.name) {
                return Err(Error::DuplicateParameter { name: parameter.name.clone() });
            }
            let is_of_chapter = PARAMETERS.iter().any(|(name, _)| *name == parameter.name);
            if !is_of_chapter && !names.contains(&parameter.name) {
                return Err(Error::UnknownParameter { name: parameter.name.clone(), known: names.join(", ") });
            }
        }
        let find = |name: &str| parameters.iter().find(|parameter| parameter.name == name);
        let value = |name: &str| find(name).map_or(0.0, |parameter| parameter.value);
        if AmplitudeHyperbola::NAMES.iter().any(|name| find(name).is_some()) {
            let [h1, h2, h3] = AmplitudeHyperbola::NAMES.map(value);
            let amplitude_span = shape.amplitude_span.ok_or(Error::MissingAmplitudeSpan)?;
            model.hyperbola = Some(AmplitudeHyperbola { h1, h2, h3, amplitude_span });
        }
        // First those of Eq. 14, so that a sine beside a spline is found and refused.
        model.terms = RangeTerms::from_array(RangeTerms::NAMES.map(value));
        let values: Vec<f64> = names.iter().map(|name| value(name)).collect();
        model.set_parameter_values(&values)?;
        model.validate()?;
        Ok(model)
    }
}

/// Unit of a parameter by its canonical name: one of [`PARAMETERS`], or `s0..`, `q1..` and `g10..` of further terms
/// (metre). `None` if there is no such parameter.
pub fn parameter_unit(name: &str) -> Option<&'static str> {
    if let Some((_, unit)) = PARAMETERS.iter().find(|(known, _)| *known == name) {
        return Some(unit);
    }
    let index = name.get(1..)?;
    // No sign, no leading zero: one name for each parameter.
    let number = index.parse::<usize>().ok().filter(|number| number.to_string() == index);
    let exists = match name.as_bytes()[0] {
        b's' => number.is_some_and(|number| number + 1 < PeriodicSpline::KNOTS[1]),
        b'q' => number.is_some_and(|order| (RangePolynomial::ORDERS[0]..=RangePolynomial::ORDERS[1]).contains(&order)),
        b'g' => is_exponent_pair(index.as_bytes()),
        _ => false,
    };
    exists.then_some("m")
}

/// Whether two digits stand for the orders in x and y of a term of a surface.
fn is_exponent_pair(digits: &[u8]) -> bool {
    let [i @ b'0'..=b'9', j @ b'0'..=b'9'] = digits else { return false };
    (ImageSurface::ORDERS[0]..=ImageSurface::ORDERS[1]).contains(&usize::from(i - b'0' + j - b'0'))
}

/// Unit of a parameter by its canonical name.
fn known(name: &str) -> Result<&'static str> {
    parameter_unit(name).ok_or_else(|| Error::UnknownParameter {
        name: name.into(),
        known: format!("{}, s0.., q1.., g10..", PARAMETERS.map(|(known, _)| known).join(", ")),
    })
}
