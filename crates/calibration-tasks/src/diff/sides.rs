//! Each file as parameters with one covariance, and what belongs together in both.

use camera_model::Camera;
use error_models::{FixedPattern, NamedParameter, RangeErrorModel};
use nalgebra::DMatrix;
use pipeline::Result;
use range_io::calibration::{Calibration, RangeCalibration};
use residual_tests::{CorrectionSide, ParameterSet};

use crate::diff::drift;

/// Both files.
pub(crate) struct Pair {
    pub(crate) first: Side,
    pub(crate) second: Side,
    /// Positions of the range models that both have.
    pub(crate) models: Vec<[usize; 2]>,
    pub(crate) models_of_first: Vec<String>,
    pub(crate) models_of_second: Vec<String>,
    pub(crate) not_tested: Vec<String>,
    pub(crate) notes: Vec<String>,
}

/// One file.
pub(crate) struct Side {
    calibration: Calibration,
    /// The parameters that are compared, named as in both files.
    pub(crate) parameters: ParameterSet,
    units: Vec<String>,
}

/// A range model with what a comparison of corrections asks for.
pub(crate) struct Correction {
    pub(crate) name: String,
    model: RangeErrorModel,
    covariance: DMatrix<f64>,
    principal_point_mm: [f64; 2],
}

/// A parameter with its name in words and its name in the file's correlations.
pub(crate) struct Listed {
    pub(crate) name: String,
    pub(crate) in_file: String,
    pub(crate) parameter: NamedParameter,
}

impl Pair {
    pub(crate) fn new(first: &Calibration, second: &Calibration) -> Result<Self> {
        let same = |a: &RangeCalibration, b: &RangeCalibration| {
            // Times and frequencies that went through a unit's conversion differ by less than a millionth.
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-6 * a.abs();
            near(a.integration_time_s, b.integration_time_s) && near(a.modulation_hz, b.modulation_hz)
        };
        let partner = |model: &RangeCalibration| second.range_models.iter().position(|other| same(model, other));
        let mut models: Vec<[usize; 2]> = Vec::new();
        let mut models_of_first = Vec::new();
        for (index, model) in first.range_models.iter().enumerate() {
            match partner(model) {
                Some(other) => models.push([index, other]),
                None => models_of_first.push(format!("range model of {}", words(model))),
            }
        }
        let models_of_second = second.range_models.iter().enumerate();
        let models_of_second = models_of_second.filter(|(j, _)| !models.iter().any(|[_, other]| other == j));
        let models_of_second = models_of_second.map(|(_, model)| format!("range model of {}", words(model))).collect();
        let drifts = drift::common_parameters(first, second);
        let lists = [(first, 0), (second, 1)].map(|(calibration, side)| {
            let mut all = listed(calibration, &models, side);
            all.extend(drift::listed(calibration, &drifts));
            all
        });
        let unknown = |list: &[Listed]| -> Vec<String> {
            list.iter().filter(|listed| listed.parameter.sigma.is_nan()).map(|listed| listed.name.clone()).collect()
        };
        let mut not_tested = [unknown(&lists[0]), unknown(&lists[1])].concat();
        not_tested.sort_unstable();
        not_tested.dedup();
        let [one, other] = lists;
        let (first_side, second_side) = (Side::new(first, one, &not_tested)?, Side::new(second, other, &not_tested)?);
        let notes = notes(first, second);
        Ok(Self {
            first: first_side,
            second: second_side,
            models,
            models_of_first,
            models_of_second,
            not_tested,
            notes,
        })
    }
}

/// Camera parameters, and those of the models that both files have.
fn listed(calibration: &Calibration, models: &[[usize; 2]], side: usize) -> Vec<Listed> {
    let camera = calibration.parameters.iter().map(|parameter| Listed {
        name: parameter.name.clone(),
        in_file: parameter.name.clone(),
        parameter: parameter.clone(),
    });
    let ranges = models.iter().flat_map(|pair| {
        let index = pair[side];
        let model = &calibration.range_models[index];
        model.parameters.iter().map(move |parameter| Listed {
            name: match models.len() {
                1 => parameter.name.clone(),
                _ => format!("{} ({})", parameter.name, words(model)),
            },
            in_file: in_file(calibration, index, &parameter.name),
            parameter: parameter.clone(),
        })
    });
    camera.chain(ranges).collect()
}

/// The name of a range parameter in the file's correlations: see [`Calibration::parameter_names`].
fn in_file(calibration: &Calibration, model: usize, name: &str) -> String {
    if calibration.range_models.len() > 1 { format!("{name}[{model}]") } else { name.to_owned() }
}

fn words(model: &RangeCalibration) -> String {
    format!("{} ms, {} MHz", 1e3 * model.integration_time_s, model.modulation_hz.round() / 1e6)
}

/// What the files say of noise, scattering and fixed pattern, which have no covariance.
fn notes(first: &Calibration, second: &Calibration) -> Vec<String> {
    let mut notes = Vec::new();
    let mut note = |differs: bool, what: &str| {
        if differs {
            notes.push(format!("{what} differ; they have no covariance and are not tested"));
        }
    };
    note(first.scattering != second.scattering, "the point spread functions of scattering");
    let patterns = first.fixed_pattern.as_ref().zip(second.fixed_pattern.as_ref());
    let tested = |a: &FixedPattern, b: &FixedPattern| !a.sigma_m.is_empty() && !b.sigma_m.is_empty();
    note(patterns.is_some_and(|(a, b)| a != b && !tested(a, b)), "the tables of offsets (fixed patterns)");
    note(first.noise != second.noise, "the noise models");
    for (name, calibration) in [("first", first), ("second", second)] {
        if calibration.correlation.is_none() {
            notes.push(format!("the {name} file states no correlations: its parameters count as uncorrelated"));
        }
    }
    notes
}

impl Side {
    fn new(calibration: &Calibration, listed: Vec<Listed>, not_tested: &[String]) -> Result<Self> {
        let tested: Vec<Listed> = listed.into_iter().filter(|listed| !not_tested.contains(&listed.name)).collect();
        let names: Vec<&str> = tested.iter().map(|listed| listed.in_file.as_str()).collect();
        let mut covariance = calibration.covariance(&names)?;
        drift::add_covariance(calibration, &names, &mut covariance)?;
        let parameters = ParameterSet {
            names: tested.iter().map(|listed| listed.name.clone()).collect(),
            values: tested.iter().map(|listed| listed.parameter.value).collect(),
            covariance,
        };
        let units = tested.into_iter().map(|listed| listed.parameter.unit).collect();
        Ok(Self { calibration: calibration.clone(), parameters, units })
    }

    pub(crate) fn unit(&self, name: &str) -> String {
        let position = self.parameters.names.iter().position(|known| known == name);
        position.map_or_else(String::new, |index| self.units[index].clone())
    }

    /// A range model; parameters without a known deviation count as known.
    pub(crate) fn correction(&self, index: usize) -> Result<Correction> {
        let written = &self.calibration.range_models[index];
        let model = written.to_model().map_err(|error| pipeline::Error::Diff(error.to_string()))?;
        let names: Vec<String> = model.to_parameters().into_iter().map(|parameter| parameter.name).collect();
        let known = |name: &String| {
            let found = written.parameters.iter().find(|parameter| parameter.name == *name);
            found.filter(|parameter| parameter.sigma.is_finite()).map(|_| in_file(&self.calibration, index, name))
        };
        let principal_point_mm = self.calibration.camera()?.interior.principal_point_mm;
        let covariance = self.covariance_of(&names.iter().map(known).collect::<Vec<_>>())?;
        Ok(Correction { name: words(written), model, covariance, principal_point_mm })
    }

    /// The camera with the covariance of its ten parameters.
    pub(crate) fn camera(&self) -> Result<(Camera, DMatrix<f64>)> {
        let known = |(name, _): (&str, &str)| {
            let found = self.calibration.parameter(name);
            found.filter(|parameter| parameter.sigma.is_finite()).map(|_| name.to_owned())
        };
        let covariance = self.covariance_of(&Calibration::CAMERA_PARAMETERS.map(known))?;
        Ok((self.calibration.camera()?, covariance))
    }

    /// Covariance by names in the file, zero for `None`.
    fn covariance_of(&self, names: &[Option<String>]) -> Result<DMatrix<f64>> {
        let there: Vec<usize> = (0..names.len()).filter(|&place| names[place].is_some()).collect();
        let known: Vec<&str> = names.iter().flatten().map(String::as_str).collect();
        let covariance = self.calibration.covariance(&known)?;
        let mut all = DMatrix::zeros(names.len(), names.len());
        for (i, &row) in there.iter().enumerate() {
            for (j, &column) in there.iter().enumerate() {
                all[(row, column)] = covariance[(i, j)];
            }
        }
        Ok(all)
    }
}

impl Correction {
    pub(crate) fn side(&self) -> CorrectionSide<'_> {
        CorrectionSide {
            model: &self.model,
            covariance: self.covariance.clone(),
            principal_point_mm: self.principal_point_mm,
        }
    }
}
