//! How poses that were registered follow the calibration that their points were made with.

use multiview_registration::{Datum, PointModel, Start, StationRegistrationOptions, register_stations};
use nalgebra::{DMatrix, Isometry3, Point3};
use point_cloud::Cloud;
use point_uncertainty::{CommonError, StationErrors};

use crate::{Error, Result};

/// Covariances of registered poses, and how they follow the errors of the calibration.
pub(crate) struct PoseErrors {
    /// With the calibration as it is: six rows a station.
    pub(crate) alone: DMatrix<f64>,
    /// Change of the poses by the errors of the calibration.
    pub(crate) by_calibration: DMatrix<f64>,
}

/// Registers the stations again from where they stand, with the errors of the calibration as further unknowns.
///
/// The joint cofactors `Q` of poses `p` and errors `c` have in them how the poses follow: `dp/dc = Q_pc Q_cc⁻¹`, whatever is
/// known of `c` beforehand, and `Q_pp - Q_pc Q_cc⁻¹ Q_cp` is the covariance where `c` is held.
pub(crate) fn pose_errors(
    clouds: &[Cloud],
    world_from_camera: &[Isometry3<f64>],
    stations: &[StationErrors],
    errors: &[CommonError],
    covariance: &DMatrix<f64>,
) -> Result<PoseErrors> {
    let model = LinearModel::new(clouds, stations, errors, covariance);
    let with = (!errors.is_empty()).then_some(&model as &dyn PointModel);
    let options = StationRegistrationOptions { model: with, ..StationRegistrationOptions::default() };
    let found = register_stations(clouds, Start::Poses(world_from_camera), Datum::Station(0), &options, &|_, _| {})?;
    let (poses, all) = (6 * clouds.len(), found.joint_covariance.whole());
    let count = all.nrows() - poses;
    let of_poses = all.view((0, 0), (poses, poses)).into_owned();
    if count == 0 {
        return Ok(PoseErrors { alone: of_poses, by_calibration: DMatrix::zeros(poses, 0) });
    }
    let across = all.view((0, poses), (poses, count)).into_owned();
    let of_errors = all.view((poses, poses), (count, count)).into_owned();
    let scaled = Scaled::new(&of_errors).ok_or(Error::Calibration)?;
    let by_calibration = scaled.times_inverse(&across);
    let alone = of_poses - &by_calibration * across.transpose();
    Ok(PoseErrors { alone: 0.5 * (&alone + alone.transpose()), by_calibration })
}

/// A covariance matrix of errors in different units, inverted in units of their deviations.
struct Scaled {
    sigma: Vec<f64>,
    inverse: DMatrix<f64>,
}

impl Scaled {
    fn new(covariance: &DMatrix<f64>) -> Option<Self> {
        let sigma: Vec<f64> = covariance.diagonal().iter().map(|variance| variance.sqrt()).collect();
        let size = sigma.len();
        let scaled =
            DMatrix::from_fn(size, size, |row, column| covariance[(row, column)] / (sigma[row] * sigma[column]));
        Some(Self { inverse: scaled.cholesky()?.inverse(), sigma })
    }

    /// `matrix Q⁻¹`.
    fn times_inverse(&self, matrix: &DMatrix<f64>) -> DMatrix<f64> {
        let size = self.sigma.len();
        let inverse = DMatrix::from_fn(size, size, |row, column| {
            self.inverse[(row, column)] / (self.sigma[row] * self.sigma[column])
        });
        matrix * inverse
    }
}

/// Points that move linearly with the errors of the calibration, in each station's frame.
struct LinearModel<'a> {
    clouds: &'a [Cloud],
    names: Vec<String>,
    sigma: Vec<f64>,
    /// Of each station, point by point.
    derivatives: Vec<Vec<[f32; 3]>>,
}

impl<'a> LinearModel<'a> {
    fn new(clouds: &'a [Cloud], stations: &[StationErrors], errors: &[CommonError], covariance: &DMatrix<f64>) -> Self {
        let count = errors.len();
        let of_station = |(cloud, station): (&Cloud, &StationErrors)| {
            let (mut all, mut of_point) = (vec![[0.0; 3]; cloud.len() * count], Vec::new());
            let camera_from_world = station.world_from_camera().rotation.inverse();
            for (index, point) in cloud.points.iter().enumerate() {
                let amplitude = cloud.intensity.as_ref().and_then(|values| values.get(index)).copied();
                of_point.clear();
                let world = station.world_from_camera() * point;
                station.common(&world, amplitude.unwrap_or(f64::NAN), &mut of_point);
                for (column, derivative) in of_point.iter().filter(|(column, _)| *column < count) {
                    let derivative = camera_from_world * derivative;
                    let sum = &mut all[index * count + column];
                    for axis in 0..3 {
                        sum[axis] += derivative[axis] as f32;
                    }
                }
            }
            all
        };
        Self {
            clouds,
            names: errors.iter().map(|error| error.name.clone()).collect(),
            sigma: covariance.diagonal().iter().map(|variance| variance.sqrt()).collect(),
            derivatives: clouds.iter().zip(stations).map(of_station).collect(),
        }
    }
}

impl PointModel for LinearModel<'_> {
    fn names(&self) -> Vec<String> {
        self.names.clone()
    }

    fn prior(&self) -> (Vec<f64>, Vec<f64>) {
        (vec![0.0; self.names.len()], self.sigma.clone())
    }

    fn point(
        &self,
        station: usize,
        index: usize,
        parameters: &[f64],
        derivatives: Option<&mut [[f64; 3]]>,
    ) -> Point3<f64> {
        let count = parameters.len();
        let own = &self.derivatives[station][index * count..(index + 1) * count];
        let mut point = self.clouds[station].points[index];
        for (by, value) in own.iter().zip(parameters) {
            for axis in 0..3 {
                point[axis] += f64::from(by[axis]) * value;
            }
        }
        if let Some(derivatives) = derivatives {
            for (derivative, by) in derivatives.iter_mut().zip(own) {
                *derivative = by.map(f64::from);
            }
        }
        point
    }
}
