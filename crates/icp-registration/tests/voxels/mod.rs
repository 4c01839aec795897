//! Clouds in voxels: averages, and registration of unorganised clouds.

mod averages;
mod bad_input;
mod poses;
mod real;
#[path = "../../examples/voxel_pairs/scenes.rs"]
mod scenes;
mod verdicts;

use icp_registration::{IcpResult, VoxelAlignmentOptions, VoxelCloud};
use nalgebra::Isometry3;
use scenes::Views;

fn register(
    views: &Views,
    guess: &Isometry3<f64>,
    options: &VoxelAlignmentOptions,
) -> Result<IcpResult, icp_registration::Error> {
    let target = VoxelCloud::new(&views.target, None)?;
    let source = VoxelCloud::new(&views.source, None)?;
    target.align(&source, guess, options)
}
