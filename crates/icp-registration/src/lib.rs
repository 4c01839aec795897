#![doc = include_str!("../README.md")]

mod error;
mod icp;
mod kernel;
pub mod parts;
pub mod quality;
mod result;
mod system;
mod target;
mod voxels;

pub use error::Error;
pub use icp::{Alternative, IcpOptions, Levels, Metric, Registration, Starts, align};
pub use kernel::{RobustKernel, TUKEY};
pub use nalgebra;
pub use parts::Selection;
pub use point_cloud::{self, Cloud};
pub use quality::{MotionKind, UndeterminedMotion};
pub use result::{DegeneracyPolicy, IcpResult, StopReason};
pub use rigid_pose;
pub use system::System;
pub use target::IcpTarget;
pub use voxels::{VoxelAlignmentOptions, VoxelCloud, downsample};
