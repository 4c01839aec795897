//! The iterative closest point algorithm: the easy tier, and the engine that runs the parts.

mod descent;
mod matching;
pub(crate) mod motion;
mod options;
mod prior;
mod quality;
mod registration;
mod result;
mod sensitivity;
mod starts;
mod system;
mod target;
mod validation;

pub use descent::{Alternative, Levels};
pub use motion::{MotionKind, UndeterminedMotion};
pub use options::{DegeneracyPolicy, IcpOptions, Metric, Selection};
pub use registration::Registration;
pub use result::{IcpResult, StopReason};
pub use starts::Starts;
pub use system::System;
pub use target::IcpTarget;

use nalgebra::Isometry3;

use point_cloud::Cloud;
use crate::error::Result;
use crate::voxels::{VoxelCloud, VoxelOptions};

/// Aligns `source` with `target`, starting at `guess` (both poses `target_from_source`).
///
/// Dense clouds of bare points go by voxels ([`Metric::Automatic`]). Others without normals get them from their nearest neighbours where
/// the metric needs them. For several sources against one target, build an [`IcpTarget`] once.
///
/// # Errors
/// [`crate::Error::TooFewCorrespondences`] where the clouds do not overlap at the guess; [`crate::Error::Empty`],
/// [`crate::Error::NonFinite`], [`crate::Error::LengthMismatch`], [`crate::Error::NotPositive`],
/// [`crate::Error::Unmeasured`], [`crate::Error::InvalidOption`] for the input.
pub fn align(source: &Cloud, target: &Cloud, guess: &Isometry3<f64>, options: &IcpOptions) -> Result<IcpResult> {
    // What is known of single points is not thrown away.
    let is_bare = [source, target].iter().all(|cloud| cloud.normals.is_none() && cloud.sigma.is_none());
    match options.by_voxels(source.len().min(target.len())).filter(|_| is_bare) {
        Some(options) => {
            let voxels = |cloud: &Cloud| VoxelCloud::new(cloud, &VoxelOptions::default());
            let (target, source) = rayon::join(|| voxels(target), || voxels(source));
            target?.align(&source?, guess, &options)
        }
        None => IcpTarget::new(target.clone())?.align(source, guess, options),
    }
}
