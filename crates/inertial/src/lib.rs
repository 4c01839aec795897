#![doc = include_str!("../README.md")]

mod error;
mod noise;
mod preintegrated;
mod propagation;
mod residual;
mod rest;
mod sample;
#[cfg(feature = "sequence")]
mod sequence;
mod state;

#[cfg(feature = "sequence")]
pub use adjust;
pub use error::Error;
use error::Result;
pub use nalgebra;
pub use noise::{Biases, ImuNoise};
pub use preintegrated::{Matrix9, Matrix9x6, Preintegrated};
pub use residual::{NavigationState, ResidualJacobians, Vector9};
pub use rest::{Rest, Unrest, rest};
pub use rigid_pose;
pub use sample::InertialSample;
#[cfg(feature = "sequence")]
pub use sequence::{CameraPose, InertialSequence, Mounting, SequenceOptions, SequenceState, estimate_sequence};
pub use state::{InertialState, StateCovariance};
