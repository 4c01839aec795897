//! Streams of organised range frames, tracked one by one.

mod imu;
mod motion;

pub use imu::{ImuIntegrator, ImuOptions, InertialSample};
pub use motion::MotionPrior;
