use error_models::{FixedPattern, NamedParameter};
use range_image::Modulation;
use scattering_deconvolution::Psf;

use super::{Calibration, RangeCalibration, ValidSpan};
use crate::InvalidField;
use crate::text::limits::MOST_PARAMETERS;

type Check = Result<(), InvalidField>;

impl Calibration {
    pub(super) fn check(&self) -> Check {
        let (version, known) = (self.format_version, Self::FORMAT_VERSION);
        require(version == known, "format_version", || {
            format!("is {version}, expected {known} (version {} is read as well)", Self::OLDEST_FORMAT_VERSION)
        })?;
        self.camera.validate().map_err(|error| InvalidField::new("camera", error.to_string()))?;
        self.check_camera_parameters()?;
        for (index, model) in self.range_models.iter().enumerate() {
            model.check(&format!("range_models[{index}]"))?;
        }
        self.group_range_models().map_err(|reason| InvalidField::new("range_models", reason))?;
        if let Some(noise) = &self.noise {
            noise.validate().map_err(|error| InvalidField::new("noise", error.to_string()))?;
        }
        if let Some(noise) = &self.range_noise {
            noise.validate().map_err(|error| InvalidField::new("range_noise", error.to_string()))?;
        }
        let names = NOISE_PARAMETERS.map(|(name, _)| name).join(", ");
        check_parameters("noise_parameters", &self.noise_parameters, noise_unit, &names)?;
        self.scattering.iter().try_for_each(check_psf)?;
        check_parameters(
            "scattering_parameters",
            &self.scattering_parameters,
            scattering_unit,
            "weight 1, sigma_px 1, ...",
        )?;
        self.fixed_pattern.iter().try_for_each(|pattern| self.check_pattern(pattern))?;
        self.warm_up.iter().try_for_each(|drift| drift.check("warm_up"))?;
        if let Some(correlation) = &self.correlation {
            correlation.check("correlation", &self.parameter_names())?;
        }
        self.span.check()?;
        match self.provenance.sigma0 {
            Some(value) => require(value.is_finite() && value >= 0.0, "provenance.sigma0", || {
                format!("is {value}, expected a finite number that is not negative")
            }),
            None => Ok(()),
        }
    }

    fn check_camera_parameters(&self) -> Check {
        let names = Self::CAMERA_PARAMETERS.map(|(name, _)| name).join(", ");
        let unit = |name: &str| Self::CAMERA_PARAMETERS.iter().find(|(known, _)| *known == name).map(|(_, unit)| *unit);
        check_parameters("parameters", &self.parameters, unit, &names)?;
        for needed in ["xp", "yp", "c"] {
            let there = self.parameters.iter().any(|parameter| parameter.name == needed);
            require(there, "parameters", || format!("`{needed}` is missing"))?;
        }
        let distance = self.parameters.iter().enumerate().find(|(_, parameter)| parameter.name == "c");
        distance.map_or(Ok(()), |(index, c)| {
            require(c.value > 0.0, format!("parameters[{index}].value"), || {
                format!("`c` is {}, expected a positive principal distance", c.value)
            })
        })
    }

    fn check_pattern(&self, pattern: &FixedPattern) -> Check {
        let (width, height) = (self.camera.width, self.camera.height);
        require((pattern.width, pattern.height) == (width, height), "fixed_pattern", || {
            format!("is {} x {} pixels, expected {width} x {height}", pattern.width, pattern.height)
        })?;
        let (found, expected) = (pattern.offset_m.len(), width.saturating_mul(height));
        require(found == expected, "fixed_pattern.offset_m", || format!("has {found} values, expected {expected}"))?;
        // A pixel without a known offset is NaN; an infinite one is a slip.
        let infinite = pattern.offset_m.iter().position(|value| value.is_infinite());
        infinite.map_or(Ok(()), |index| {
            Err(InvalidField::new(format!("fixed_pattern.offset_m[{index}]"), "is infinite, expected metres"))
        })?;
        let found = pattern.sigma_m.len();
        require(found == 0 || found == expected, "fixed_pattern.sigma_m", || {
            format!("has {found} values, expected {expected} or none")
        })?;
        let bad = pattern.sigma_m.iter().position(|sigma| *sigma < 0.0 || sigma.is_infinite());
        bad.map_or(Ok(()), |index| {
            let field = format!("fixed_pattern.sigma_m[{index}]");
            Err(InvalidField::new(field, "is no standard deviation, expected NaN or a number that is not negative"))
        })
    }
}

impl RangeCalibration {
    fn check(&self, path: &str) -> Check {
        let time = self.integration_time_s;
        require(time.is_finite() && time > 0.0, format!("{path}.integration_time_s"), || {
            format!("is {time}, expected a positive time")
        })?;
        Modulation::new(self.modulation_hz)
            .map_err(|error| InvalidField::new(format!("{path}.modulation_hz"), error.to_string()))?;
        let names = error_models::PARAMETERS.map(|(name, _)| name).join(", ");
        let names = format!("{names}, or s0.., q1.., g10.. of further terms");
        check_parameters(&format!("{path}.parameters"), &self.parameters, error_models::parameter_unit, &names)?;
        check_span(format!("{path}.range_span_m"), self.range_span_m)?;
        check_span(format!("{path}.amplitude_span"), self.amplitude_span)?;
        self.to_model().map(drop).map_err(|error| InvalidField::new(path, error.to_string()))
    }
}

impl ValidSpan {
    /// Whether a range or an amplitude lies outside of what the calibration rests on; one that is not known does not.
    #[inline]
    pub fn leaves_out(&self, range_m: f64, amplitude: f64) -> bool {
        let outside = |span: Option<[f64; 2]>, value: f64| span.is_some_and(|[low, high]| value < low || value > high);
        outside(self.range_m, range_m) || outside(self.amplitude, amplitude)
    }

    fn check(&self) -> Check {
        check_span("span.range_m", self.range_m)?;
        check_span("span.amplitude", self.amplitude)?;
        check_span("span.integration_time_s", self.integration_time_s)?;
        check_span("span.temperature_c", self.temperature_c)
    }
}

fn check_span(field: impl Into<String>, span: Option<[f64; 2]>) -> Check {
    let Some([low, high]) = span else { return Ok(()) };
    require(low.is_finite() && high.is_finite() && low <= high, field, || {
        format!("is ({low}, {high}), expected the smaller and the larger end")
    })
}

/// Names known and given once, the units of the table, finite values, standard deviations that may be.
fn check_parameters(
    path: &str,
    parameters: &[NamedParameter],
    known: impl Fn(&str) -> Option<&'static str>,
    names: &str,
) -> Check {
    let count = parameters.len();
    require(count <= MOST_PARAMETERS, path, || format!("has {count} parameters, expected at most {MOST_PARAMETERS}"))?;
    for (index, parameter) in parameters.iter().enumerate() {
        let NamedParameter { name, value, sigma, unit, .. } = parameter;
        let path = format!("{path}[{index}]");
        let Some(expected) = known(name) else {
            return Err(InvalidField::new(
                format!("{path}.name"),
                format!("`{name}` is no parameter, expected one of {names}"),
            ));
        };
        let twice = parameters[..index].iter().any(|earlier| earlier.name == *name);
        require(!twice, format!("{path}.name"), || format!("`{name}` is given twice"))?;
        require(unit == expected, format!("{path}.unit"), || {
            format!("`{name}` is in `{unit}`, expected `{expected}`")
        })?;
        require(value.is_finite(), format!("{path}.value"), || format!("`{name}` is {value}, expected a number"))?;
        // NaN says that the standard deviation is not known.
        require(!(*sigma < 0.0 || sigma.is_infinite()), format!("{path}.sigma"), || {
            format!("standard deviation of `{name}` is {sigma}, expected a finite number that is not negative")
        })?;
    }
    Ok(())
}

/// Names and units of the parameters of the noise; `amplitude` stands for the unit of the samples or of the amplitude.
const NOISE_PARAMETERS: [(&str, &str); 5] = [
    ("shot_variance_per_unit", "amplitude"),
    ("dark_sigma", "amplitude"),
    ("quantisation_sigma", "amplitude"),
    ("sigma_times_amplitude_m", "m*amplitude"),
    ("floor_m", "m"),
];

fn noise_unit(name: &str) -> Option<&'static str> {
    NOISE_PARAMETERS.iter().find(|(known, _)| *known == name).map(|(_, unit)| *unit)
}

/// Weights are shares of the light, widths are in pixels; both are numbered by their Gaussian.
fn scattering_unit(name: &str) -> Option<&'static str> {
    let (quantity, term) = name.rsplit_once(' ')?;
    term.parse::<usize>().ok()?;
    match quantity {
        "weight" => Some("1"),
        "sigma_px" | "sigma_px across" | "sigma_px down" => Some("px"),
        _ => None,
    }
}

fn check_psf(psf: &Psf) -> Check {
    match psf {
        Psf::Gaussians(terms) => {
            for (index, term) in terms.iter().enumerate() {
                let widths = term.sigma_px.iter().all(|sigma| sigma.is_finite() && *sigma > 0.0);
                require(term.weight.is_finite() && widths, format!("scattering[{index}]"), || {
                    let (weight, [along_row, along_column]) = (term.weight, term.sigma_px);
                    format!(
                        "has weight {weight} and widths ({along_row}, {along_column}), \
                         expected a finite weight and positive widths"
                    )
                })?;
            }
            Ok(())
        }
        Psf::Kernel { width, height, values } => {
            let odd = width % 2 == 1 && height % 2 == 1;
            require(odd && width.checked_mul(*height) == Some(values.len()), "scattering", || {
                format!(
                    "is a kernel of {width} x {height} with {} values, expected odd sizes and their product",
                    values.len()
                )
            })?;
            let finite = values.iter().all(|value| value.is_finite());
            require(finite, "scattering", || "has a kernel with values that are not finite".into())
        }
        Psf::Composite(_) => psf.validate().map_err(|error| InvalidField::new("scattering", error.to_string())),
    }
}

pub(super) fn require(holds: bool, field: impl Into<String>, reason: impl FnOnce() -> String) -> Check {
    if holds { Ok(()) } else { Err(InvalidField::new(field, reason())) }
}
