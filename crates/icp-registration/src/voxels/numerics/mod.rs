//! Sums over voxels and where these lie.

pub(in crate::voxels) mod blocks;
pub(in crate::voxels) mod gather;
pub(in crate::voxels) mod lattice;
pub(in crate::voxels) mod moments;

/// An entry of a table that holds nothing.
const FREE: u32 = u32::MAX;
