//! Points that depend on parameters which all stations share.

use nalgebra::Point3;
use rigid_pose::{InputError, require_length, require_points};

use crate::error::Result;

/// Points that depend on parameters which all stations share, such as the terms of a range error: what the sensor is
/// stays outside this crate.
///
/// With it the parameters are estimated together with the poses: surfaces seen from several stations agree only with
/// the right ones.
pub trait PointModel: Sync {
    /// Names of the parameters, in their order.
    fn names(&self) -> Vec<String>;

    /// Values that are known beforehand, which are also the start, and their standard deviations (infinite: nothing is
    /// known), in the units of the parameters.
    fn prior(&self) -> (Vec<f64>, Vec<f64>);

    /// Point `index` of `station` at these parameters in the station's frame, metre, and its derivative by each
    /// parameter where `derivatives` is given (one entry a parameter, to be overwritten).
    fn point(
        &self,
        station: usize,
        index: usize,
        parameters: &[f64],
        derivatives: Option<&mut [[f64; 3]]>,
    ) -> Point3<f64>;
}

/// The estimated parameters of a [`PointModel`].
#[derive(Debug, Clone, PartialEq)]
pub struct SharedParameters {
    /// Their names.
    pub names: Vec<String>,
    /// Their values.
    pub values: Vec<f64>,
    /// Covariance matrix, row by row; as honest as that of the poses.
    pub covariance: Vec<Vec<f64>>,
    /// Prior values.
    pub prior: Vec<f64>,
    /// Standard deviations of the prior values; infinite without prior.
    pub prior_sigma: Vec<f64>,
    /// Difference from the prior value in standard deviations of the estimate: beyond 3 the surfaces ask for it.
    pub significance: Vec<f64>,
    /// Largest correlation (absolute) of each parameter with a component of a station's pose: the station, the
    /// component of `[dt, dtheta]`, the correlation. Near one, the stations' geometry does not tell the two apart.
    pub largest_pose_correlation: Vec<(usize, usize, f64)>,
}

impl SharedParameters {
    /// Standard deviations of the values.
    pub fn sigma(&self) -> Vec<f64> {
        (0..self.values.len()).map(|i| self.covariance[i][i].max(0.0).sqrt()).collect()
    }
}

/// Values and standard deviations of the shared parameters beforehand.
pub(crate) type Prior = (Vec<f64>, Vec<f64>);

/// Refuses a model whose lists differ in length or are not numbers, and returns the prior.
pub(crate) fn checked_prior(model: &dyn PointModel) -> Result<Prior> {
    let (values, sigma) = model.prior();
    let expected = model.names().len();
    for found in [values.len(), sigma.len()] {
        require_length("prior of the point model", expected, found)?;
    }
    if let Some(index) = values.iter().position(|v| !v.is_finite()) {
        return Err(InputError::NonFinite { what: "prior of the point model", index }.into());
    }
    if let Some(index) = sigma.iter().position(|s| s.is_nan() || *s <= 0.0) {
        return Err(
            InputError::NotPositive { what: "prior sigma of the point model", index, value: sigma[index] }.into()
        );
    }
    Ok((values, sigma))
}

/// Points, with their derivatives by all parameters, point by point.
pub(crate) type Evaluated = (Vec<Point3<f64>>, Vec<[f64; 3]>);

/// All points of a station at these parameters, with the derivatives of each (one entry a parameter).
pub(crate) fn evaluated(model: &dyn PointModel, station: usize, count: usize, parameters: &[f64]) -> Result<Evaluated> {
    let m = parameters.len();
    let mut derivatives = vec![[0.0; 3]; count * m];
    let point = |index: usize| {
        let own = &mut derivatives[index * m..(index + 1) * m];
        model.point(station, index, parameters, Some(own))
    };
    let points: Vec<Point3<f64>> = (0..count).map(point).collect();
    require_points("points of the point model", &points)?;
    match derivatives.iter().position(|d| !d.iter().all(|v| v.is_finite())) {
        Some(index) => Err(InputError::NonFinite { what: "derivatives of the point model", index }.into()),
        None => Ok((points, derivatives)),
    }
}
