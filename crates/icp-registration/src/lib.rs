#![doc = include_str!("../README.md")]

mod error;
mod icp;
mod kernel;
#[cfg(feature = "mesh")]
mod mesh;
pub mod parts;
pub mod quality;
mod voxels;

pub use error::{Error, Result};
pub use icp::{
    Alternative, DegeneracyPolicy, IcpOptions, IcpResult, IcpTarget, Levels, Metric, MotionKind, Registration,
    Selection, Starts, StopReason, System, UndeterminedMotion, align,
};
pub use kernel::RobustKernel;
pub use nalgebra;
pub use point_cloud::{self, Cloud};
pub use rigid_pose;
pub use voxels::{VoxelAlignmentOptions, VoxelCloud, VoxelOptions, downsample};
