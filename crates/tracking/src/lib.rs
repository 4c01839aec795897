#![doc = include_str!("../README.md")]

mod error;
mod imu;
mod map;
mod motion_model;
mod options;
mod stream;
mod tracked;
mod trajectory;

pub use error::Error;
pub use global_registration;
pub use imu::ImuIntegrator;
pub use inertial;
pub use inertial::{ImuNoise, InertialSample};
pub use map::options::MapOptions;
pub use map::surfaces::SurfaceMap;
pub use motion_model::motion::MotionPrior;
pub use nalgebra;
pub use options::{Relocalisation, TrackerOptions};
pub use point_cloud;
pub use projective_registration;
pub use rigid_pose;
pub use stream::tracker::Tracker;
pub use tracked::{LossReason, TrackedPose, TrackingState};
pub use trajectory::{
    AbsoluteTrajectoryError, ErrorStatistics, MatchedPose, RelativeError, RelativePoseError, RelativeStep,
    TrajectoryAlignment, TrajectoryErrorOptions, absolute_trajectory_error, relative_pose_error,
};
