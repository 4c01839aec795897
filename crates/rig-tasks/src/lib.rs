#![doc = include_str!("../README.md")]

mod document;
mod file;
mod run;
mod summary;

pub use calibration_tasks;
pub use file::{CameraEntry, RigFile, RigPose, is_rig};
pub use run::calibrate_rig;
pub use summary::{CameraSummary, EpochResidual, MountingSummary, RigSummary};
