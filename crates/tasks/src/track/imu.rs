//! Inertial data that `survey.ron` names among its extras.

use std::path::Path;

use commands::{INERTIAL_DATA, InertialUnit, read_inertial};
use pipeline::{Error, Result};
use range_io::survey::Survey;
use tracking::{ImuIntegrator, MotionPrior, TrackedPose};

/// Motions between frames from an inertial unit.
pub(crate) struct Inertial {
    unit: InertialUnit,
    integrator: Option<ImuIntegrator>,
}

impl Inertial {
    /// Reads what the survey names; `None` where it names nothing.
    pub(crate) fn read(survey: &Survey, root: &Path) -> Result<Option<Self>> {
        let unit = read_inertial(survey, root)?;
        Ok(unit.map(|unit| Self { unit, integrator: None }))
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
        let InertialUnit { samples, camera_from_body, noise } = &self.unit;
        let Some(integrator) = &mut self.integrator else {
            let resting = samples.partition_point(|sample| sample.timestamp_s <= timestamp_s);
            let mut integrator =
                ImuIntegrator::from_rest(&samples[..resting], camera_from_body, noise).map_err(refused)?;
            integrator.motion(samples, timestamp_s).map_err(refused)?;
            self.integrator = Some(integrator);
            return Ok(None);
        };
        integrator.motion(samples, timestamp_s).map(Some).map_err(refused)
    }

    /// What the frames measured of the motion corrects the unit.
    pub(crate) fn learn(&mut self, pose: &TrackedPose) -> Result<()> {
        let Some(integrator) = &mut self.integrator else { return Ok(()) };
        let learnt = integrator.frame(pose.measured_motion.as_ref());
        learnt.map_err(|error| Error::registration(&format!("inertial data at {} s", pose.timestamp_s), &error))
    }
}
