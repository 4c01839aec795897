#![doc = include_str!("../README.md")]

mod certificate;
mod colour;
mod document;
mod file;
mod run;
mod summary;

pub use calibration_tasks;
pub use certificate::{CameraCheck, CertifiedMounting, RigCertificate};
pub use colour::{ColourRequest, ColourSummary, Colouring, Unseen, colour, colour_points, read_mountings};
pub use file::{CameraEntry, RigFile, RigPose, is_rig};
pub use run::calibrate_rig;
pub use summary::{CameraSummary, EpochResidual, MountingSummary, RigSummary};
