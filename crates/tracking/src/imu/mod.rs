//! Motion between frames from angular rates and accelerations.
//!
//! Rates and specific forces are integrated from frame to frame in the axes that the body had at the last frame. The
//! errors of displacement, rotation, velocity, attitude and of both biases are carried along in one covariance of 18
//! components, so that the motion comes with the covariance that [`MotionPrior`](super::MotionPrior) asks for. What
//! the frames then measure of the same motion corrects velocity, attitude and biases (an error-state Kalman filter
//! as in `[Sola2017]`). Gravity is found while the body rests.

mod options;
mod propagation;
mod rest;
mod state;
mod update;

pub use inertial::InertialSample;
pub use options::ImuOptions;

use nalgebra::{Isometry3, Matrix6, Vector3};

use super::MotionPrior;
use crate::error::{Error, Result};
use rigid_pose::{inverse_covariance_transport, symmetrised};
use state::State;

/// Integrates inertial samples between frames.
#[derive(Debug, Clone)]
pub struct ImuIntegrator {
    options: ImuOptions,
    state: State,
    /// The sample at the time that the state has reached.
    last: InertialSample,
}

impl ImuIntegrator {
    /// Finds the direction of gravity and the bias of the gyroscope from samples of a body at rest (a second of them
    /// is plenty); the state then stands at the last of these.
    ///
    /// # Errors
    /// [`Error::TooFewPoints`] below two samples, [`Error::Moving`] where the body did not rest,
    /// [`Error::NonFinite`], [`Error::NotAscending`], [`Error::InvalidOption`] for the input.
    pub fn from_rest(samples: &[InertialSample], options: &ImuOptions) -> Result<Self> {
        options.validate()?;
        let (state, last) = rest::at_rest(samples, options)?;
        Ok(Self { options: options.clone(), state, last })
    }

    /// Integrates up to `until_s` and returns the motion of the camera since the last frame.
    ///
    /// `samples` ascend in time; those before the state's time are passed over, those after `until_s` serve to
    /// interpolate. Where they end early, the last sample is held, at most for [`ImuOptions::max_gap_s`].
    ///
    /// # Errors
    /// [`Error::NoInertialData`] where there is no sample for longer than that; [`Error::NonFinite`],
    /// [`Error::NotAscending`].
    pub fn motion(&mut self, samples: &[InertialSample], until_s: f64) -> Result<MotionPrior> {
        check_samples(samples)?;
        if !until_s.is_finite() || until_s < self.last.timestamp_s {
            return Err(Error::NotAscending { what: "times of the motion", index: 0 });
        }
        let mut state = self.state.clone();
        let mut last = self.last;
        for sample in samples {
            if sample.timestamp_s <= last.timestamp_s {
                continue;
            }
            self.require_no_gap(last.timestamp_s, sample.timestamp_s.min(until_s))?;
            let next = if sample.timestamp_s > until_s { last.interpolated(sample, until_s) } else { *sample };
            propagation::propagate(&mut state, &last, &next, &self.options);
            last = next;
            if last.timestamp_s >= until_s {
                break;
            }
        }
        if last.timestamp_s < until_s {
            self.require_no_gap(last.timestamp_s, until_s)?;
            let held = InertialSample { timestamp_s: until_s, ..last };
            propagation::propagate(&mut state, &last, &held, &self.options);
            last = held;
        }
        (self.state, self.last) = (state, last);
        Ok(self.prior())
    }

    /// Tells that a frame was taken at the time the state has reached: the next motion counts from here. `measured` is
    /// what the frames alone say of the motion since the one before (see
    /// [`TrackedPose::measured_motion`](super::TrackedPose::measured_motion)); it corrects velocity, attitude and
    /// biases.
    ///
    /// # Errors
    /// [`Error::Numerical`] where the covariance of the measured motion cannot be used.
    pub fn frame(&mut self, measured: Option<&MotionPrior>) -> Result<()> {
        if let Some(measured) = measured {
            let previous_from_current = measured.current_from_previous.inverse();
            let covariance = inverse_covariance_transport(&measured.current_from_previous, &measured.covariance);
            let body_from_camera = self.options.camera_from_body.inverse();
            let (motion, jacobian) = conjugated(&body_from_camera, &previous_from_current);
            update::update(&mut self.state, &motion, &symmetrised(&(jacobian * covariance * jacobian.transpose())))?;
        }
        self.state.rebase();
        Ok(())
    }

    /// Time the state has reached, second.
    pub fn timestamp_s(&self) -> f64 {
        self.last.timestamp_s
    }

    /// Velocity in the axes that the body had at the last frame, metre per second.
    pub fn velocity_m_s(&self) -> Vector3<f64> {
        self.state.velocity
    }

    /// Direction of gravity (unit vector, downwards) in the axes that the body had at the last frame.
    pub fn down(&self) -> Vector3<f64> {
        self.state.world_from_start.inverse() * -Vector3::z()
    }

    /// Biases of rates (rad/s) and specific forces (m/s²).
    pub fn biases(&self) -> [Vector3<f64>; 2] {
        [self.state.gyro_bias, self.state.accel_bias]
    }

    fn prior(&self) -> MotionPrior {
        let start_from_body = self.state.start_from_body();
        let covariance: Matrix6<f64> = self.state.covariance.fixed_view::<6, 6>(0, 0).into_owned();
        let (motion, jacobian) = conjugated(&self.options.camera_from_body, &start_from_body);
        let covariance = symmetrised(&(jacobian * covariance * jacobian.transpose()));
        MotionPrior {
            current_from_previous: motion.inverse(),
            covariance: inverse_covariance_transport(&motion, &covariance),
        }
    }

    fn require_no_gap(&self, from_s: f64, to_s: f64) -> Result<()> {
        let seconds = to_s - from_s;
        if seconds > self.options.max_gap_s {
            return Err(Error::NoInertialData { from_s, seconds, allowed_s: self.options.max_gap_s });
        }
        Ok(())
    }
}

/// The motion of frame a that is rigidly joined to frame b, from the motion of b, and the Jacobian of its tangent.
fn conjugated(a_from_b: &Isometry3<f64>, motion: &Isometry3<f64>) -> (Isometry3<f64>, Matrix6<f64>) {
    // X T X⁻¹: its rotation follows as Rx dθ; its translation Rx t + tx − Rx R Rxᵀ tx as Rx dt + Rx R [Rxᵀ tx]x dθ.
    let rx = a_from_b.rotation.to_rotation_matrix().into_inner();
    let r = motion.rotation.to_rotation_matrix().into_inner();
    let lever = (rx.transpose() * a_from_b.translation.vector).cross_matrix();
    let mut jacobian = Matrix6::zeros();
    jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&rx);
    jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&(rx * r * lever));
    jacobian.fixed_view_mut::<3, 3>(3, 3).copy_from(&rx);
    (a_from_b * motion * a_from_b.inverse(), jacobian)
}

fn check_samples(samples: &[InertialSample]) -> Result<()> {
    for (index, sample) in samples.iter().enumerate() {
        if !sample.is_finite() {
            return Err(Error::NonFinite { what: "the inertial samples", index });
        }
        if index > 0 && sample.timestamp_s <= samples[index - 1].timestamp_s {
            return Err(Error::NotAscending { what: "times of the inertial samples", index });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
