//! What an inertial unit on the camera says of the motion between two frames.
//!
//! The state of the unit's body in its own axes at the frame before (velocity, biases, gravity) is carried on by its samples; what the
//! frames measured of the motion corrects it. No drift is corrected from outside: positions come from the frames alone.

use inertial::{ImuNoise, InertialSample, InertialState};
use nalgebra::{Isometry3, Vector3};
use rigid_pose::{Uncertain, require_pose};

use crate::MotionPrior;
use crate::error::{Error, Result};

/// Motion priors from an inertial unit.
#[derive(Debug, Clone)]
pub struct ImuIntegrator {
    camera_from_body: Isometry3<f64>,
    noise: ImuNoise,
    /// In the body's axes at the frame before.
    state: InertialState,
    /// In the same axes, now.
    now: InertialState,
    /// From the last one before that frame on.
    samples: Vec<InertialSample>,
}

impl ImuIntegrator {
    /// Begins with samples of a unit at rest, half a second at least; `camera_from_body` is the pose of its axes in the camera's frame. The
    /// last sample is the first moment that motions begin at.
    ///
    /// # Errors
    /// [`Error::Inertial`] where the unit did not rest or its samples or noise cannot be used, [`Error::Input`] for the mounting.
    pub fn from_rest(samples: &[InertialSample], camera_from_body: &Isometry3<f64>, noise: &ImuNoise) -> Result<Self> {
        require_pose("camera_from_body", camera_from_body)?;
        let last_s = samples.last().map_or(0.0, |sample| sample.timestamp_s);
        let state = InertialState::at_rest(samples, last_s, &Uncertain::exact(Isometry3::identity()), noise)?;
        let samples = samples.last().copied().into_iter().collect();
        Ok(Self { camera_from_body: *camera_from_body, noise: *noise, now: state.clone(), state, samples })
    }

    /// The camera's motion from the frame before to a moment, second. Samples ascend in time; those that are known already are passed over,
    /// so that a growing list may be given again and again.
    ///
    /// # Errors
    /// [`Error::Inertial`] where there is no sample for longer than [`ImuNoise::max_gap_s`], and for samples that cannot be used;
    /// [`Error::NotAscending`] for a moment before the last one. The integrator is then as before.
    pub fn motion(&mut self, samples: &[InertialSample], until_s: f64) -> Result<MotionPrior> {
        if !until_s.is_finite() || until_s < self.now.time_s {
            return Err(Error::NotAscending { what: "times of the motion", index: 0 });
        }
        let known_s = self.samples.last().map_or(f64::NEG_INFINITY, |sample| sample.timestamp_s);
        let first = samples.partition_point(|sample| sample.timestamp_s <= known_s);
        // One sample behind the moment: the samples between are interpolated.
        let end = (samples.partition_point(|sample| sample.timestamp_s < until_s) + 1).clamp(first, samples.len());
        let known = self.samples.len();
        self.samples.extend_from_slice(&samples[first..end]);
        match self.state.carried(&self.samples, until_s, &self.noise) {
            Ok(now) => self.now = now,
            Err(error) => {
                self.samples.truncate(known);
                return Err(error.into());
            }
        }
        let camera = Uncertain::exact(self.camera_from_body);
        let motion = camera.then(&self.now.pose()).then(&camera.inverse()).inverse();
        Ok(MotionPrior { current_from_previous: motion.pose, covariance: motion.covariance })
    }

    /// Ends the motion at a frame: the next one begins there. `measured` is what the frames said of it, whose errors are independent of the
    /// unit's: it corrects velocity, biases and gravity.
    ///
    /// # Errors
    /// [`Error::Inertial`] where the covariance of `measured` is not positive definite.
    pub fn frame(&mut self, measured: Option<&MotionPrior>) -> Result<()> {
        if let Some(&MotionPrior { current_from_previous: pose, covariance }) = measured {
            let camera = Uncertain::exact(self.camera_from_body);
            let motion = Uncertain { pose, covariance }.inverse();
            self.now.learn(&camera.inverse().then(&motion).then(&camera))?;
        }
        self.now = self.now.in_own_axes();
        self.state = self.now.clone();
        let before = self.samples.partition_point(|sample| sample.timestamp_s <= self.now.time_s).saturating_sub(1);
        self.samples.drain(..before);
        Ok(())
    }

    /// The moment that is reached, second.
    #[must_use]
    pub fn timestamp_s(&self) -> f64 {
        self.now.time_s
    }

    /// Velocity of the unit, metre per second, in its axes at the frame before.
    #[must_use]
    pub fn velocity_m_s(&self) -> Vector3<f64> {
        self.now.navigation.velocity
    }

    /// Where down is, in the unit's axes at the frame before.
    #[must_use]
    pub fn down(&self) -> Vector3<f64> {
        self.now.gravity.normalize()
    }

    /// Biases of rates (rad/s) and forces (m/s²).
    #[must_use]
    pub fn biases(&self) -> [Vector3<f64>; 2] {
        [self.now.biases.gyro, self.now.biases.accel]
    }
}
