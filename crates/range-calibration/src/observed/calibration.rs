//! The result of a range calibration.

use adjust::{Diagnosis, Scale, Solution};
use error_models::{NamedParameter, RangeErrorModel, parameter_unit};
use nalgebra::DMatrix;

use crate::Result;

/// Range terms estimated from range differences, with their quality.
#[derive(Debug)]
pub struct RangeCalibration {
    pub(crate) model: RangeErrorModel,
    pub(crate) solution: Solution,
    pub(crate) rms_before_m: f64,
    pub(crate) rms_after_m: f64,
}

impl RangeCalibration {
    /// The model to correct frames with. Its spans are those of the observed ranges and amplitudes.
    pub fn model(&self) -> &RangeErrorModel {
        &self.model
    }

    /// All parameters of the model with their standard deviations of the chosen scale, held ones with zero; the form
    /// calibration files keep.
    pub fn parameters(&self, scale: Scale) -> Result<Vec<NamedParameter>> {
        let covariance = self.covariance(scale)?;
        let mut parameters = self.model.to_parameters();
        for parameter in &mut parameters {
            let column = self.solution.unknown_names().iter().position(|name| *name == parameter.name);
            if let Some(column) = column {
                let sigma = covariance[(column, column)].sqrt();
                *parameter = NamedParameter::estimated(&parameter.name, parameter.value, sigma)?;
            }
        }
        Ok(parameters)
    }

    /// Names of the estimated parameters, in the order of the matrices.
    pub fn estimated_names(&self) -> &[String] {
        self.solution.unknown_names()
    }

    /// Units of the estimated parameters, in the order of the matrices.
    pub fn estimated_units(&self) -> Vec<&'static str> {
        self.estimated_names().iter().map(|name| parameter_unit(name).unwrap_or_default()).collect()
    }

    /// Covariance matrix of the estimated parameters. [`Scale::Prior`] takes the standard deviations of the
    /// differences as they were given, [`Scale::Posterior`] scales them with sigma0.
    pub fn covariance(&self, scale: Scale) -> Result<DMatrix<f64>> {
        Ok(self.solution.covariance_matrix(scale)?)
    }

    /// Correlation matrix of the estimated parameters.
    pub fn correlation(&self) -> DMatrix<f64> {
        self.solution.correlation_matrix()
    }

    /// Posterior standard deviation of unit weight: 1 where the given standard deviations are right.
    ///
    /// Pixels of one station share errors of the reference and of what is not modelled. Where this is well above 1,
    /// the deviations of the parameters are too small even when scaled with it.
    pub fn sigma0(&self) -> Option<f64> {
        self.solution.sigma0()
    }

    /// Schwarz's information criterion `n ln(vᵀPv / n) + u ln n` of n differences and u unknowns `[Schwarz1978]`: of two
    /// calibrations from the same differences, the one with the smaller is to be preferred. `-∞` where nothing is left
    /// over.
    pub fn schwarz_criterion(&self) -> f64 {
        let n = self.solution.observations() as f64;
        n * (self.solution.vtpv() / n).ln() + self.solution.unknowns() as f64 * n.ln()
    }

    /// Differences minus unknowns.
    pub fn redundancy(&self) -> i64 {
        self.solution.redundancy()
    }

    /// Residuals v = observed − model in the order of the differences, metre.
    pub fn residuals_m(&self) -> &[f64] {
        self.solution.residuals()
    }

    /// Root mean square of the differences as given, metre.
    pub fn rms_before_m(&self) -> f64 {
        self.rms_before_m
    }

    /// Root mean square of the residuals, metre.
    pub fn rms_after_m(&self) -> f64 {
        self.rms_after_m
    }

    /// The weakest combination of parameters, and the pairs with a correlation of at least `limit`.
    pub fn diagnosis(&self, limit: f64) -> Diagnosis {
        self.solution.diagnosis(limit)
    }
}
