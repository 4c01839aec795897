//! Unorganised clouds in cubes of space: averages, and registration by what the points of each cube look like.

mod align;
mod cloud;
mod downsample;
mod level;
mod numerics;
mod options;
mod pairs;
mod samples;
mod scale;
mod wide;

pub use cloud::VoxelCloud;
pub use downsample::downsample;
pub use options::VoxelAlignmentOptions;
