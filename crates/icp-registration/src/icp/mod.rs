//! The iterative closest point algorithm: the easy tier, and the engine that runs the parts.

pub(crate) mod engine;
mod prior;
mod starts;
mod validation;

pub use engine::descent::{Alternative, Levels};
pub use engine::options::{IcpOptions, Metric};
pub use engine::registration::Registration;
pub use starts::Starts;

use nalgebra::Isometry3;

use crate::error::Result;
use crate::result::IcpResult;
use crate::target::IcpTarget;
use crate::voxels::VoxelCloud;
use point_cloud::Cloud;

/// Aligns `source` with `target`, starting at `guess` (both poses `target_from_source`).
///
/// Dense clouds of bare points go by voxels ([`Metric::Automatic`]). Others without normals get them from their nearest neighbours where
/// the metric needs them. For several sources against one target, build an [`IcpTarget`] once.
///
/// # Errors
/// [`InputError::TooFewCorrespondences`](rigid_pose::InputError::TooFewCorrespondences) where the clouds do not overlap at the guess; [`crate::Error::Cloud`],
/// [`InputError::NonFinite`](rigid_pose::InputError::NonFinite), [`InputError::InvalidOption`](rigid_pose::InputError::InvalidOption) for the input.
pub fn align(source: &Cloud, target: &Cloud, guess: &Isometry3<f64>, options: &IcpOptions) -> Result<IcpResult> {
    // What is known of single points is not thrown away.
    let is_bare = [source, target].iter().all(|cloud| cloud.normals.is_none() && cloud.sigma.is_none());
    match options.by_voxels(source.len().min(target.len())).filter(|_| is_bare) {
        Some(options) => {
            let voxels = |cloud: &Cloud| VoxelCloud::new(cloud, None);
            let (target, source) = rayon::join(|| voxels(target), || voxels(source));
            target?.align(&source?, guess, &options)
        }
        None => IcpTarget::new(target.clone())?.align(source, guess, options),
    }
}
