//! Velocities, biases, gravity and mounting along a sequence of camera poses.

mod equations;
mod estimate;
mod noise_at_work;
mod options;
mod start;

pub use estimate::estimate_sequence;
pub use options::{CameraPose, InertialSequence, Mounting, SequenceOptions, SequenceState};
