//! Between the lists of a calibration's file and the models that stages work with.

use camera_model::{Camera, InteriorOrientation, LensDistortion};
use error_models::{ModelSet, ModelShape, NamedParameter, ParameterStatus, RangeErrorModel};
use range_image::{Modulation, SPEED_OF_LIGHT};
use scattering_deconvolution::Psf;

use super::{Calibration, Provenance, RangeCalibration, ValidSpan};
use crate::{Error, Result};

/// Models of all frequencies with the integration time they belong to.
type Groups = Vec<(f64, Vec<usize>)>;

impl Calibration {
    /// A calibration with all parameters held at those of given models.
    ///
    /// A modulation frequency follows from its model's ambiguity interval in vacuum. Nothing is said of the span, the
    /// noise or the origin: set those fields on the result.
    pub fn from_models(camera: &Camera, range_models: &ModelSet, scattering: Option<&Psf>) -> Result<Self> {
        let models = range_models.entries.iter().flat_map(|(time, models)| models.iter().map(|model| (*time, model)));
        let calibration = Self {
            format_version: Self::FORMAT_VERSION,
            camera: camera.format,
            parameters: camera_values(camera).into_iter().map(held).collect(),
            range_models: models.map(|(time, model)| RangeCalibration::from_model(time, model)).collect(),
            noise: None,
            range_noise: None,
            noise_parameters: Vec::new(),
            scattering: scattering.cloned(),
            scattering_parameters: Vec::new(),
            fixed_pattern: None,
            warm_up: None,
            correlation: None,
            span: ValidSpan::default(),
            provenance: Provenance::default(),
        };
        calibration.validate()?;
        Ok(calibration)
    }

    /// A parameter of interior orientation or lens by name.
    pub fn parameter(&self, name: &str) -> Option<&NamedParameter> {
        self.parameters.iter().find(|parameter| parameter.name == name)
    }

    /// The camera with its estimated interior orientation and lens.
    pub fn camera(&self) -> Result<Camera> {
        let value = |name: &str| self.parameter(name).map_or(0.0, |parameter| parameter.value);
        let interior =
            InteriorOrientation { principal_point_mm: [value("xp"), value("yp")], principal_distance_mm: value("c") };
        let lens = LensDistortion::from_coefficients(LensDistortion::NAMES.map(value));
        Camera::new(self.camera, interior, lens).map_err(|error| value_error("camera", &error))
    }

    /// The range-error models by integration time, frequencies in the order of the file; empty where there are none.
    pub fn model_set(&self) -> Result<ModelSet> {
        let groups = self.group_range_models().map_err(|reason| Error::Value {
            what: "calibration",
            field: "range_models".into(),
            reason,
        })?;
        let mut entries = Vec::with_capacity(groups.len());
        for (time, members) in groups {
            let models = members.into_iter().map(|index| self.range_models[index].to_model());
            let models: std::result::Result<Vec<_>, error_models::Error> = models.collect();
            entries.push((time, models.map_err(|error| value_error("range_models", &error))?));
        }
        entries.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        Ok(ModelSet { entries })
    }

    /// The modulation of each frequency that has range models, in the order of the file.
    pub fn modulations(&self) -> Result<Vec<Modulation>> {
        let Some(first) = self.range_models.first() else { return Ok(Vec::new()) };
        let members = self.range_models.iter().filter(|model| same(model.integration_time_s, first.integration_time_s));
        members
            .map(|model| Modulation::new(model.modulation_hz).map_err(|error| value_error("modulation_hz", &error)))
            .collect()
    }

    /// Positions of the models of each integration time; each time must have the same frequencies in the same order.
    pub(super) fn group_range_models(&self) -> std::result::Result<Groups, String> {
        let mut groups = Groups::new();
        for (index, model) in self.range_models.iter().enumerate() {
            match groups.iter_mut().find(|(time, _)| same(*time, model.integration_time_s)) {
                Some((_, members)) => members.push(index),
                None => groups.push((model.integration_time_s, vec![index])),
            }
        }
        let frequencies =
            |members: &[usize]| members.iter().map(|&i| self.range_models[i].modulation_hz).collect::<Vec<_>>();
        let Some((first_time, first)) = groups.first() else { return Ok(groups) };
        let expected = frequencies(first);
        if let Some((index, hz)) = expected.iter().enumerate().find(|(i, hz)| expected[..*i].contains(hz)) {
            return Err(format!("frequency {hz} Hz has two models at {first_time} s, the second as number {index}"));
        }
        match groups.iter().find(|(_, members)| frequencies(members) != expected) {
            None => Ok(groups),
            Some((time, members)) => Err(format!(
                "has frequencies {:?} Hz at {time} s, expected {expected:?} as at {first_time} s",
                frequencies(members)
            )),
        }
    }
}

impl RangeCalibration {
    /// The terms of a model, all held.
    pub fn from_model(integration_time_s: f64, model: &RangeErrorModel) -> Self {
        Self {
            integration_time_s,
            modulation_hz: frequency_of(model.ambiguity_interval_m),
            parameters: model.to_parameters(),
            range_span_m: model.range_span_m,
            amplitude_span: model.hyperbola.map(|hyperbola| hyperbola.amplitude_span),
            further: model.further.shape(),
        }
    }

    /// The model of these terms.
    pub fn to_model(&self) -> std::result::Result<RangeErrorModel, error_models::Error> {
        let interval_m = Modulation::new(self.modulation_hz)?.ambiguity_interval_m();
        let (amplitude_span, range_span_m, further) = (self.amplitude_span, self.range_span_m, self.further);
        let shape = ModelShape { amplitude_span, range_span_m, further };
        RangeErrorModel::from_shape(interval_m, &self.parameters, &shape)
    }
}

/// Equal to the last bit, as values from one file are.
fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits()
}

/// Frequency of an ambiguity interval in vacuum; whole hertz where they give the interval to the last bit.
fn frequency_of(interval_m: f64) -> f64 {
    let hz = SPEED_OF_LIGHT / (2.0 * interval_m);
    let exact = Modulation::new(hz.round()).is_ok_and(|whole| same(whole.ambiguity_interval_m(), interval_m));
    if exact { hz.round() } else { hz }
}

/// Values in the order of [`Calibration::CAMERA_PARAMETERS`], with their names and units.
fn camera_values(camera: &Camera) -> Vec<(&'static str, &'static str, f64)> {
    let [xp, yp] = camera.interior.principal_point_mm;
    let interior = [xp, yp, camera.interior.principal_distance_mm];
    let values = interior.into_iter().chain(camera.lens.coefficients());
    Calibration::CAMERA_PARAMETERS.into_iter().zip(values).map(|((name, unit), value)| (name, unit, value)).collect()
}

fn held((name, unit, value): (&str, &str, f64)) -> NamedParameter {
    NamedParameter { name: name.into(), value, sigma: 0.0, unit: unit.into(), status: ParameterStatus::Held }
}

fn value_error(field: &str, error: &dyn std::error::Error) -> Error {
    Error::Value { what: "calibration", field: field.into(), reason: error.to_string() }
}
