//! Inertial data that `survey.ron` names among its extras.

use std::path::Path;

use commands::{INERTIAL_DATA, InertialUnit, read_inertial};
use pipeline::{Error, Result};
use range_io::survey::Survey;
use tracking::{ImuIntegrator, ImuOptions, InertialSample, MotionPrior, TrackedPose};

/// Motions between frames from an inertial unit.
pub(crate) struct Inertial {
    samples: Vec<InertialSample>,
    options: ImuOptions,
    integrator: Option<ImuIntegrator>,
}

impl Inertial {
    /// Reads what the survey names; `None` where it names nothing.
    pub(crate) fn read(survey: &Survey, root: &Path) -> Result<Option<Self>> {
        let Some(InertialUnit { samples, camera_from_body, noise }) = read_inertial(survey, root)? else {
            return Ok(None);
        };
        let options = ImuOptions {
            camera_from_body,
            gyro_noise: noise.gyro_density,
            accel_noise: noise.accel_density,
            gyro_walk: noise.gyro_walk,
            accel_walk: noise.accel_walk,
            ..ImuOptions::default()
        };
        Ok(Some(Self { samples, options, integrator: None }))
    }

    /// The camera's motion since the frame before; `None` at the first frame, up to which the unit must rest.
    pub(crate) fn motion(&mut self, timestamp_s: f64) -> Result<Option<MotionPrior>> {
        let refused = |error: tracking::Error| {
            let what = format!(
                "inertial data at {timestamp_s} s (without `{INERTIAL_DATA}` among its extras the survey is tracked by its \
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
