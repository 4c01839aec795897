//! How a camera is mounted on a carrier whose poses something else measures: a robot's wrist, a tracker, satellites and
//! inertial navigation.

mod carrier;
mod clocks;
mod closed_form;
mod determined;
mod equations;
mod estimate;
mod options;
mod predicted;

pub use carrier::TimedPose;
pub use determined::Undetermined;
pub use estimate::estimate_mounting;
pub use options::{LeverArm, Mounting, MountingOptions, MountingResidual, TimeOffset};
