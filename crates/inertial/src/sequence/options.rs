//! What a sequence is estimated from, and what comes out.

use adjust::SolveOptions;
use nalgebra::{Isometry3, Matrix3, Matrix6, Vector3};
use rigid_pose::{Uncertain, product_jacobians};

use crate::noise::{Biases, ImuNoise};
use crate::residual::NavigationState;
use crate::rest::GRAVITY_M_S2;
use crate::state::{GRAVITY_SIGMA_M_S2, InertialState, StateCovariance};

/// A pose of the camera from a registration, from tracking or from targets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraPose {
    /// Time, second.
    pub time_s: f64,
    /// `world_from_camera` with its covariance in the tangent `[dt, dθ]`. Errors of different poses are taken as independent.
    pub pose: Uncertain,
}

/// How the unit sits on the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mounting {
    /// Pose of the unit's axes in the camera's frame.
    Known(Isometry3<f64>),
    /// Its translation is known; its rotation is found, wherever it starts.
    UnknownRotation {
        /// Position of the unit in the camera's frame, metre.
        lever_arm: Vector3<f64>,
    },
}

/// How to estimate a sequence.
#[derive(Debug, Clone, PartialEq)]
pub struct SequenceOptions {
    /// The unit. Default: [`ImuNoise::default`].
    pub noise: ImuNoise,
    /// The mounting. Default: the unit's axes are those of the camera's photogrammetric frame (x right, y up, looking along −z).
    pub mounting: Mounting,
    /// Length of gravity, m/s². Default 9.80665.
    pub gravity_m_s2: f64,
    /// Its standard deviation, m/s². Default 0.02: what it differs by from the poles to the equator.
    pub gravity_sigma_m_s2: f64,
    /// Options of the adjustment. Default: that of [`SolveOptions`].
    pub solve: SolveOptions,
}

impl Default for SequenceOptions {
    fn default() -> Self {
        Self {
            noise: ImuNoise::default(),
            mounting: Mounting::Known(Isometry3::identity()),
            gravity_m_s2: GRAVITY_M_S2,
            gravity_sigma_m_s2: GRAVITY_SIGMA_M_S2,
            solve: SolveOptions::default(),
        }
    }
}

/// The state at one camera pose; covariances are prior-scaled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SequenceState {
    /// Time, second.
    pub time_s: f64,
    /// The adjusted pose of the camera.
    pub world_from_camera: Uncertain,
    /// Velocity of the unit, world axes, m/s.
    pub velocity: Vector3<f64>,
    /// Biases.
    pub biases: Biases,
    /// Covariance of the camera's pose (its tangent), the velocity, the biases `[gyro, accel]` and gravity, together: a bias of the forces
    /// and gravity can hardly be told apart by a unit that turns little, while what they make of a motion is known well.
    pub covariance: StateCovariance,
}

impl SequenceState {
    /// Covariance of the velocity.
    #[must_use]
    pub fn velocity_covariance(&self) -> Matrix3<f64> {
        self.covariance.fixed_view::<3, 3>(6, 6).into_owned()
    }

    /// Covariance of `[gyro, accel]`.
    #[must_use]
    pub fn bias_covariance(&self) -> Matrix6<f64> {
        self.covariance.fixed_view::<6, 6>(9, 9).into_owned()
    }
}

/// A sequence that camera and unit agree on.
#[derive(Debug, Clone, PartialEq)]
pub struct InertialSequence {
    /// States at the camera's poses.
    pub states: Vec<SequenceState>,
    /// Gravity, world axes, m/s².
    pub gravity: Vector3<f64>,
    /// Its covariance.
    pub gravity_covariance: Matrix3<f64>,
    /// Pose of the unit's axes in the camera's frame; the covariance is that of the rotation where it was found, else zero.
    pub camera_from_body: Uncertain,
    /// Intervals (k lies between poses k and k + 1) whose samples contradict the camera and took no part, ascending.
    pub contradicting: Vec<usize>,
    /// The noise of the unit as its motions show it: that of the options, with larger densities where the intervals scatter by more at a
    /// level of 0.1 %. All covariances here have it.
    pub noise: ImuNoise,
    /// Observations minus unknowns.
    pub redundancy: i64,
    /// Posterior standard deviation of unit weight; `None` without redundancy.
    pub sigma0: Option<f64>,
}

impl InertialSequence {
    /// The state of the unit's body at pose `index`, with the correlations of its pose, velocity, biases and gravity; `None` where there is
    /// no such pose.
    #[must_use]
    pub fn state_of_body(&self, index: usize) -> Option<InertialState> {
        let state = self.states.get(index)?;
        let (camera, body) = (&state.world_from_camera.pose, &self.camera_from_body.pose);
        let mut to_body = StateCovariance::identity();
        to_body.fixed_view_mut::<6, 6>(0, 0).copy_from(&product_jacobians(camera, body).0);
        Some(InertialState {
            time_s: state.time_s,
            navigation: NavigationState { world_from_body: camera * body, velocity: state.velocity },
            biases: state.biases,
            gravity: self.gravity,
            covariance: to_body * state.covariance * to_body.transpose(),
        })
    }
}
