//! What a mounting is estimated from, and what comes out.

use adjust::SolveOptions;
use nalgebra::{Isometry3, Matrix3, Matrix6, Vector3};
use rigid_pose::Uncertain;

use crate::{Error, Result};

/// What is known of the clocks.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum TimeOffset {
    /// A camera's time plus this, second, is the carrier's.
    Known(f64),
    /// It is to be found, not larger than this either way, second.
    Within(f64),
}

/// A lever arm that is known before, from a drawing for instance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeverArm {
    /// Perspective centre in the carrier's axes, metre.
    pub vector: Vector3<f64>,
    /// Its covariance, square metre.
    pub covariance: Matrix3<f64>,
}

/// How to estimate a mounting.
#[derive(Debug, Clone, PartialEq)]
pub struct MountingOptions {
    /// The clocks. Default: `TimeOffset::Known(0.0)`.
    pub time_offset: TimeOffset,
    /// A lever arm known before; needed where the carrier does not turn about two axes. Default: none.
    pub lever_arm: Option<LeverArm>,
    /// Longest time between two poses of the carrier that are interpolated, second. Default 0.1: hands and vehicles move by less
    /// than their noise from a straight line in that time. Where times of carrier and camera are the same, nothing is interpolated.
    pub max_gap_s: f64,
    /// Seed of the choice of samples. Default 0.
    pub seed: u64,
    /// Options of the adjustment. Default: that of [`SolveOptions`].
    pub solve: SolveOptions,
}

impl Default for MountingOptions {
    fn default() -> Self {
        let (time_offset, solve) = (TimeOffset::Known(0.0), SolveOptions::default());
        Self { time_offset, lever_arm: None, max_gap_s: 0.1, seed: 0, solve }
    }
}

/// What is left of one pose of the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MountingResidual {
    /// Number of the camera's pose.
    pub index: usize,
    /// Observed minus modelled position of the camera, target axes, metre.
    pub shift_m: Vector3<f64>,
    /// Rotation from model to observation, camera axes, radian.
    pub turn_rad: Vector3<f64>,
    /// Square over the covariances of both poses, six degrees of freedom; of a pose that took part, a little less.
    pub square: f64,
}

/// Where the camera sits on its carrier, and where its targets stand in the world.
#[derive(Debug, Clone, PartialEq)]
pub struct Mounting {
    /// Lever arm and rotation (boresight), with the covariance of their tangent, prior-scaled.
    pub carrier_from_camera: Uncertain,
    /// The frame that the camera's poses are in, in that of the carrier's poses.
    pub world_from_target: Uncertain,
    /// Covariance of the two: rows the mounting, columns the target.
    pub cross_covariance: Matrix6<f64>,
    /// Time offset and its standard deviation, second, where it was estimated.
    pub time_offset_s: Option<[f64; 2]>,
    /// Residuals of all camera poses that the carrier's trajectory covers, ascending.
    pub residuals: Vec<MountingResidual>,
    /// Camera poses that contradict the others and took no part, ascending.
    pub gross_errors: Vec<usize>,
    /// Camera poses that the carrier's trajectory does not cover, ascending.
    pub uncovered: Vec<usize>,
    /// Observations minus unknowns.
    pub redundancy: i64,
    /// Posterior standard deviation of unit weight; `None` without redundancy.
    pub sigma0: Option<f64>,
}

impl Mounting {
    /// Where the camera is in the frame of its targets, when the carrier is there.
    pub fn target_from_camera(&self, world_from_carrier: &Isometry3<f64>) -> Isometry3<f64> {
        self.world_from_target.pose.inverse() * world_from_carrier * self.carrier_from_camera.pose
    }
}

impl MountingOptions {
    pub(crate) fn check(&self) -> Result<()> {
        let refuse = |name, value, expected| Err(Error::InvalidOption { name, value, expected });
        if self.max_gap_s.is_nan() || self.max_gap_s < 0.0 {
            return refuse("max_gap_s", self.max_gap_s, "a time, zero or more");
        }
        match self.time_offset {
            TimeOffset::Known(value) if !value.is_finite() => return refuse("time_offset", value, "a finite time"),
            TimeOffset::Within(value) if !(value > 0.0 && value.is_finite()) => {
                return refuse("time_offset", value, "a positive and finite time");
            }
            _ => {}
        }
        match &self.lever_arm {
            Some(lever) if !lever.vector.iter().all(|x| x.is_finite()) => {
                refuse("lever_arm", lever.vector.norm(), "three finite lengths")
            }
            _ => Ok(()),
        }
    }
}
