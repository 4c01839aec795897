use nalgebra::{DMatrix, SMatrix};
use serde::{Deserialize, Serialize};

use super::Calibration;
use super::check::require;
use crate::{Error, InvalidField, Result};

/// Rounding that a correlation matrix may carry: products of a few hundred terms in double precision.
pub(super) const ROUNDING: f64 = 1e-9;

/// Correlations between estimated parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Correlation {
    /// Names as [`Calibration::parameter_names`] gives them, or those of a part with correlations of its own.
    pub names: Vec<String>,
    /// Rows of the symmetric matrix in the order of the names.
    pub matrix: Vec<Vec<f64>>,
}

impl Correlation {
    pub(super) fn check(&self, path: &str, known: &[String]) -> std::result::Result<(), InvalidField> {
        for (index, name) in self.names.iter().enumerate() {
            let field = || format!("{path}.names[{index}]");
            require(known.contains(name), field(), || {
                format!("`{name}` is no parameter of this calibration, expected one of {}", known.join(", "))
            })?;
            require(!self.names[..index].contains(name), field(), || format!("`{name}` is given twice"))?;
        }
        let size = self.names.len();
        let rows = self.matrix.len();
        require(rows == size, format!("{path}.matrix"), || format!("has {rows} rows for {size} names"))?;
        for (i, row) in self.matrix.iter().enumerate() {
            let columns = row.len();
            require(columns == size, format!("{path}.matrix[{i}]"), || {
                format!("has {columns} values for {size} names")
            })?;
        }
        for (i, row) in self.matrix.iter().enumerate() {
            for (j, &value) in row.iter().enumerate() {
                self.check_element(path, i, j, value)?;
            }
        }
        Ok(())
    }

    fn check_element(&self, path: &str, i: usize, j: usize, value: f64) -> std::result::Result<(), InvalidField> {
        let field = || format!("{path}.matrix[{i}][{j}]");
        let pair = || format!("correlation of `{}` and `{}`", self.names[i], self.names[j]);
        require(value.abs() <= 1.0 + ROUNDING, field(), || format!("{} is {value}, expected -1 to 1", pair()))?;
        let other = self.matrix[j][i];
        require((value - other).abs() <= ROUNDING, field(), || {
            format!("{} is {value}, but {other} the other way round", pair())
        })?;
        let unit = i != j || (value - 1.0).abs() <= ROUNDING;
        require(unit, field(), || format!("{} is {value}, expected 1", pair()))
    }

    /// Correlation of two parameters, `None` where one is not in the matrix.
    pub fn between(&self, a: &str, b: &str) -> Option<f64> {
        let position = |name: &str| self.names.iter().position(|known| known == name);
        self.matrix.get(position(a)?)?.get(position(b)?).copied()
    }
}

impl Calibration {
    /// Names of all parameters in the order of the file: those of the camera, then those of each range model.
    ///
    /// With one range model its names stand as they are (`d0`); with more they carry its position (`d0[1]`).
    pub fn parameter_names(&self) -> Vec<String> {
        self.named_sigmas().into_iter().map(|(name, _)| name).collect()
    }

    fn named_sigmas(&self) -> Vec<(String, f64)> {
        let camera = self.parameters.iter().map(|parameter| (parameter.name.clone(), parameter.sigma));
        let several = self.range_models.len() > 1;
        let ranges = self.range_models.iter().enumerate().flat_map(|(index, model)| {
            model.parameters.iter().map(move |parameter| {
                let name = &parameter.name;
                (if several { format!("{name}[{index}]") } else { name.clone() }, parameter.sigma)
            })
        });
        camera.chain(ranges).collect()
    }

    /// Covariance matrix of parameters by name, in the squares and products of their units.
    ///
    /// A parameter that the file does not list has none; one whose standard deviation is not known is an error.
    pub fn covariance(&self, names: &[&str]) -> Result<DMatrix<f64>> {
        let known = self.named_sigmas();
        let unknown = |name: &&&str| known.iter().any(|(known, sigma)| known == **name && sigma.is_nan());
        if let Some(unknown) = names.iter().find(unknown) {
            return Err(Error::Value {
                what: "calibration",
                field: (*unknown).to_owned(),
                reason: "has no known standard deviation".into(),
            });
        }
        Ok(covariance(names, &known, self.correlation.as_ref()))
    }

    /// Covariance matrix of interior orientation and lens in the order of [`Calibration::CAMERA_PARAMETERS`].
    pub fn camera_covariance(&self) -> Result<SMatrix<f64, 10, 10>> {
        let covariance = self.covariance(&Self::CAMERA_PARAMETERS.map(|(name, _)| name))?;
        Ok(SMatrix::from_fn(|i, j| covariance[(i, j)]))
    }
}

/// From standard deviations by name, zero for a name that is not among them.
pub(super) fn covariance(names: &[&str], sigmas: &[(String, f64)], correlation: Option<&Correlation>) -> DMatrix<f64> {
    let sigma = |name: &str| sigmas.iter().find(|(known, _)| known == name).map_or(0.0, |(_, sigma)| *sigma);
    let of = |a: &str, b: &str| {
        let given = correlation.and_then(|correlation| correlation.between(a, b));
        given.unwrap_or(if a == b { 1.0 } else { 0.0 })
    };
    DMatrix::from_fn(names.len(), names.len(), |i, j| sigma(names[i]) * sigma(names[j]) * of(names[i], names[j]))
}
