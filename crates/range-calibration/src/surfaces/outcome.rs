use error_models::{NamedParameter, RangeErrorModel};
use multiview_registration::{SharedParameters, StationRegistration};
use nalgebra::DMatrix;

use crate::{Error, Result};

/// Range terms estimated together with the poses, with their quality.
#[derive(Debug, Clone)]
pub struct SurfaceCalibration {
    model: RangeErrorModel,
    shared: SharedParameters,
    /// Registration with the known model alone.
    pub before: StationRegistration,
    /// Registration with the estimated terms; its joint covariance holds the terms behind the poses.
    pub after: StationRegistration,
}

impl SurfaceCalibration {
    pub(super) fn new(model: RangeErrorModel, before: StationRegistration, after: StationRegistration) -> Result<Self> {
        let shared = after.parameters.clone().ok_or(Error::NothingToEstimate)?;
        Ok(Self { model, shared, before, after })
    }

    /// The model to correct frames with: the known one with the estimated terms.
    pub fn model(&self) -> &RangeErrorModel {
        &self.model
    }

    /// All parameters of the model, estimated ones with their standard deviations, held ones with zero.
    pub fn parameters(&self) -> Result<Vec<NamedParameter>> {
        let mut parameters = self.model.to_parameters();
        for (name, sigma) in self.shared.names.iter().zip(self.shared.sigma()) {
            if let Some(parameter) = parameters.iter_mut().find(|parameter| parameter.name == *name) {
                *parameter = NamedParameter::estimated(name, parameter.value, sigma)?;
            }
        }
        Ok(parameters)
    }

    /// Names of the estimated terms, in the order of [`Self::covariance`].
    pub fn estimated_names(&self) -> &[String] {
        &self.shared.names
    }

    /// Covariance matrix of the estimated terms, the poses being unknown as well.
    pub fn covariance(&self) -> DMatrix<f64> {
        let count = self.shared.names.len();
        DMatrix::from_fn(count, count, |row, column| self.shared.covariance[row][column])
    }

    /// What else the registration says of the estimated terms: prior values, significance, correlation with the poses.
    pub fn shared(&self) -> &SharedParameters {
        &self.shared
    }

    /// Root mean square distance of surfaces seen from two stations, before and after, metre: double walls shrink.
    pub fn surface_rms_m(&self) -> [f64; 2] {
        [&self.before, &self.after].map(|registration| {
            let squares = registration.surfaces.iter().map(|pair| pair.contacts as f64 * pair.rms_m.powi(2));
            let contacts: usize = registration.surfaces.iter().map(|pair| pair.contacts).sum();
            (squares.sum::<f64>() / contacts.max(1) as f64).sqrt()
        })
    }
}
