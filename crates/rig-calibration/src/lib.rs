#![doc = include_str!("../README.md")]

mod adjustment;
mod alone;
mod calibrate;
mod error;
mod hold_out;
mod mountings;
mod names;
mod outcome;
mod rig;
mod selection;
mod world;

pub use calibrate::calibrate_rig;
pub use error::Error;
pub use hold_out::hold_out;
pub use outcome::{MountedCamera, MountingResidual, RigOutcome};
pub use rig::{Rig, RigCamera};
// Of the signatures.
pub use {calibration_network, camera_model, error_models, nalgebra, self_calibration};

use error::Result;
