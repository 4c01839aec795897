//! Inertial data that `survey.ron` names among its extras.

use std::path::Path;

use nalgebra::Vector3;
use pipeline::{Error, Result};
use range_io::survey::Survey;
use range_io::tables::read_imu;
use tracking::{ImuIntegrator, ImuOptions, InertialSample, MotionPrior, TrackedPose};

use crate::register::guess::matrix;

/// Names among a survey's extras: the data, and sixteen numbers that lead from the unit's axes to the camera's.
const DATA: &str = "imu";
const MOUNTING: &str = "camera_from_imu";

/// Motions between frames from an inertial unit.
pub(crate) struct Inertial {
    samples: Vec<InertialSample>,
    options: ImuOptions,
    integrator: Option<ImuIntegrator>,
}

impl Inertial {
    /// Reads what the survey names; `None` where it names nothing.
    pub(crate) fn read(survey: &Survey, root: &Path) -> Result<Option<Self>> {
        let Some(file) = survey.extras.get(DATA) else { return Ok(None) };
        let sample = |sample: range_io::tables::ImuSample| InertialSample {
            timestamp_s: sample.timestamp_s,
            angular_rate: Vector3::from(sample.angular_rate),
            specific_force: Vector3::from(sample.acceleration),
        };
        let samples = read_imu(root.join(file))?.into_iter().map(sample).collect();
        let mut options = ImuOptions::default();
        if let Some(file) = survey.extras.get(MOUNTING) {
            let path = root.join(file);
            let mounting = matrix(&path)?;
            options.camera_from_body = mounting.ok_or_else(|| {
                let message = format!("{}: expected the sixteen numbers of a 4 x 4 matrix", path.display());
                Error::Request { command: "register", message }
            })?;
        }
        Ok(Some(Self { samples, options, integrator: None }))
    }

    /// The camera's motion since the frame before; `None` at the first frame, up to which the unit must rest.
    pub(crate) fn motion(&mut self, timestamp_s: f64) -> Result<Option<MotionPrior>> {
        let refused = |error: tracking::Error| {
            let what = format!(
                "inertial data at {timestamp_s} s (without `{DATA}` among its extras the survey is tracked by its \
                 frames alone)"
            );
            Error::registration(&what, &error)
        };
        let Some(integrator) = &mut self.integrator else {
            let resting = self.samples.partition_point(|sample| sample.timestamp_s <= timestamp_s);
            let mut integrator = ImuIntegrator::from_rest(&self.samples[..resting], &self.options).map_err(refused)?;
            integrator.motion(&self.samples[resting..], timestamp_s).map_err(refused)?;
            self.integrator = Some(integrator);
            return Ok(None);
        };
        let from = self.samples.partition_point(|sample| sample.timestamp_s <= integrator.timestamp_s());
        integrator.motion(&self.samples[from..], timestamp_s).map(Some).map_err(refused)
    }

    /// What the frames measured of the motion corrects the unit.
    pub(crate) fn learn(&mut self, pose: &TrackedPose) -> Result<()> {
        let Some(integrator) = &mut self.integrator else { return Ok(()) };
        let learnt = integrator.frame(pose.measured_motion.as_ref());
        learnt.map_err(|error| Error::registration(&format!("inertial data at {} s", pose.timestamp_s), &error))
    }
}
