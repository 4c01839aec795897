//! Streams of organised range frames, tracked one by one.
//!
//! Each frame is registered with a keyframe, not with the frame before: sensor-fixed errors pull registrations towards
//! no motion, and each registration adds its error. Keyframes are pieces of the map: their planes move to the weighted
//! mean of all frames that saw them, as the volume of `[Newcombe2011]` does. Where a frame leaves a motion open that
//! the frame before left determined, that one becomes a keyframe; what stays open is carried on by a prior or at
//! constant velocity. Registrations between keyframes form a graph of poses, which is adjusted where an old keyframe
//! is seen again. Errors that all frames of the sensor share are carried along apart from random ones: they do not average
//! out, but are the same wherever the camera comes again.

mod imu;
mod keyframes;
mod locate;
mod motion;
mod options;
mod prediction;
mod reference;
mod returns;
mod tracked;
mod tracker;
mod unguessed;
mod velocity;
mod wide;

pub use imu::{ImuIntegrator, ImuOptions, InertialSample};
pub use motion::MotionPrior;
pub use options::{Fusion, Relocalisation, TrackerOptions};
pub use tracked::{LossReason, TrackedPose, TrackingState};
pub use tracker::Tracker;
