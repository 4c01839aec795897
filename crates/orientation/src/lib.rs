#![doc = include_str!("../README.md")]

mod approximation;
mod error;
mod identification;
mod linearity;
mod model;
mod mounting;
mod relative;
mod resection;
mod robust_pose;
mod target;
mod three_points;

pub use adjust;
pub use approximation::approximate_poses;
pub use camera_model;
pub use error::Error;
use error::Result;
pub use identification::{
    Identification, IdentificationOptions, NameCheckOptions, NameVerdict, UnnamedTarget, check_names, identify_targets,
};
pub use mounting::{
    LeverArm, Mounting, MountingOptions, MountingResidual, TimeOffset, TimedPose, Undetermined, estimate_mounting,
};
pub use nalgebra;
pub use relative::{
    ImagePoint, NetworkOptions, NetworkScale, ObjectPoint, ObservedPart, OrientedNetwork, OrientedStation,
    RelativeOrientation, RelativeOrientationOptions, TieObservation, orient_network, orient_two_views,
};
pub use resection::{Resection, ResectionOptions, Start, TargetResidual, resect};
pub use rigid_pose;
pub use robust_pose::{intersect_rays, robust_absolute_orientation, robust_resection, trimmed_resection};
pub use target::{ObservedRange, TargetObservation};
