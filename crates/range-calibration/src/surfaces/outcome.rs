use camera_model::Camera;
use error_models::{AmplitudeHyperbola, NamedParameter, RangeErrorModel};
use multiview_registration::{SharedParameters, StationRegistration};
use nalgebra::{DMatrix, Isometry3};

use super::selection::HeldTerm;
use super::sensor_model::{CAMERA_NAMES, SensorModel, camera_values};
use crate::{Error, Result};

/// Range terms and parameters of the camera estimated together with the poses, with their quality.
#[derive(Debug, Clone)]
pub struct SurfaceCalibration {
    model: RangeErrorModel,
    camera: Camera,
    names: Vec<String>,
    shared: SharedParameters,
    /// Derivatives of the terms by what was estimated: of another kind for a hyperbola.
    by_shared: DMatrix<f64>,
    /// Terms that the surfaces do not determine, held at their start values.
    pub held: Vec<HeldTerm>,
    /// Registration with the known model alone.
    pub before: StationRegistration,
    /// Registration with the estimated terms.
    pub after: StationRegistration,
}

/// What was estimated, to be put in the terms' own form.
pub(super) struct Estimate<'a> {
    pub(super) known: &'a RangeErrorModel,
    pub(super) camera: Camera,
    pub(super) model: &'a SensorModel<'a>,
    pub(super) shared: SharedParameters,
    pub(super) held: Vec<HeldTerm>,
}

impl Estimate<'_> {
    pub(super) fn outcome(self, before: StationRegistration, after: StationRegistration) -> Result<SurfaceCalibration> {
        let Self { known, camera, model, shared, held } = self;
        let mut adjusted = known.clone();
        let mut values = known.parameter_values();
        let all = known.parameter_names();
        for (parameter, value) in model.range.iter().zip(&shared.values) {
            if let Some(position) = all.iter().position(|name| *name == parameter.name) {
                values[position] = *value;
            }
        }
        adjusted.set_parameter_values(&values)?;
        let (names, by_shared) = named(model, &shared);
        let (ranges, amplitudes) = (model.range.len(), model.amplitudes());
        if let Some(amplitude) = &model.amplitude {
            let hyperbola = amplitude.hyperbola(&shared.values[ranges..ranges + amplitudes]);
            let reason = "its value in the dark would not lie above its level in bright light";
            adjusted.hyperbola = Some(hyperbola.ok_or(Error::NoHyperbola { reason })?);
        }
        adjusted.validate()?;
        camera.validate()?;
        Ok(SurfaceCalibration { model: adjusted, camera, names, shared, by_shared, held, before, after })
    }
}

/// Names of the terms, and their derivatives by what was estimated: three coefficients for the numbers of a hyperbola.
fn named(model: &SensorModel<'_>, shared: &SharedParameters) -> (Vec<String>, DMatrix<f64>) {
    let (ranges, amplitudes, count) = (model.range.len(), model.amplitudes(), shared.values.len());
    let Some(amplitude) = &model.amplitude else { return (shared.names.clone(), DMatrix::identity(count, count)) };
    let by_numbers = amplitude.coefficients_by_numbers(&shared.values[ranges..ranges + amplitudes]);
    // A coefficient that follows none of them is held: h1 at a level of zero.
    let follows = |row: &usize| amplitude.free.iter().any(|number| by_numbers[(*row, *number)] != 0.0);
    let rows: Vec<usize> = (0..3).filter(follows).collect();
    let coefficients = rows.iter().map(|row| AmplitudeHyperbola::NAMES[*row].to_owned());
    let lens = &shared.names[ranges + amplitudes..];
    let names = shared.names[..ranges].iter().cloned().chain(coefficients).chain(lens.iter().cloned()).collect();
    let mut by_shared = DMatrix::zeros(ranges + rows.len() + lens.len(), count);
    by_shared.view_mut((0, 0), (ranges, ranges)).fill_with_identity();
    let first_of_lens = (ranges + rows.len(), ranges + amplitudes);
    by_shared.view_mut(first_of_lens, (lens.len(), lens.len())).fill_with_identity();
    for (column, number) in amplitude.free.iter().enumerate() {
        for (at, row) in rows.iter().enumerate() {
            by_shared[(ranges + at, ranges + column)] = by_numbers[(*row, *number)];
        }
    }
    (names, by_shared)
}

impl SurfaceCalibration {
    /// The model to correct frames with: the known one with the estimated terms.
    pub fn model(&self) -> &RangeErrorModel {
        &self.model
    }

    /// The camera with the estimated parameters.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// All parameters of the range model, then those of the camera that were estimated; estimated ones with their standard deviations,
    /// held ones with zero.
    pub fn parameters(&self) -> Result<Vec<NamedParameter>> {
        let covariance = self.covariance();
        let sigma = |name: &str| {
            let at = self.names.iter().position(|estimated| estimated == name)?;
            Some(covariance[(at, at)].max(0.0).sqrt())
        };
        let mut parameters = self.model.to_parameters();
        for parameter in &mut parameters {
            if let Some(sigma) = sigma(&parameter.name) {
                *parameter = NamedParameter::estimated(&parameter.name, parameter.value, sigma)?;
            }
        }
        Ok(parameters)
    }

    /// Value and standard deviation of each parameter of the camera, in the order `xp, yp, c, k1, k2, k3, p1, p2, b1, b2`; `None` for
    /// those that were held.
    pub fn camera_parameters(&self) -> Vec<(&'static str, f64, Option<f64>)> {
        let covariance = self.covariance();
        let of = |(name, value)| {
            let at = self.names.iter().position(|estimated| estimated == name);
            (name, value, at.map(|at| covariance[(at, at)].max(0.0).sqrt()))
        };
        CAMERA_NAMES.into_iter().zip(camera_values(&self.camera)).map(of).collect()
    }

    /// Names of the estimated terms, in the order of [`Self::covariance`].
    pub fn estimated_names(&self) -> &[String] {
        &self.names
    }

    /// Covariance matrix of the estimated terms, the poses being unknown as well.
    pub fn covariance(&self) -> DMatrix<f64> {
        let count = self.shared.values.len();
        let shared = DMatrix::from_fn(count, count, |row, column| self.shared.covariance[row][column]);
        let covariance = &self.by_shared * shared * self.by_shared.transpose();
        0.5 * (&covariance + covariance.transpose())
    }

    /// Covariance of all poses and terms: six rows a station in the tangent `[dt world axes, dtheta station axes]`, then the
    /// terms.
    pub fn joint_covariance(&self) -> DMatrix<f64> {
        let joint = &self.after.joint_covariance.whole();
        let (terms, shared) = self.by_shared.shape();
        let poses = joint.nrows() - shared;
        let mut by = DMatrix::zeros(poses + terms, joint.nrows());
        by.view_mut((0, 0), (poses, poses)).fill_with_identity();
        by.view_mut((poses, poses), (terms, shared)).copy_from(&self.by_shared);
        let covariance = &by * joint * by.transpose();
        0.5 * (&covariance + covariance.transpose())
    }

    /// What else the registration says of what was estimated: prior values, significance, correlation with the poses. A
    /// hyperbola stands there as its corrections at three amplitudes.
    pub fn shared(&self) -> &SharedParameters {
        &self.shared
    }

    /// Adjusted poses, in the order of the captures.
    pub fn world_from_camera(&self) -> &[Isometry3<f64>] {
        &self.after.world_from_station
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
