//! Unorganised clouds in cubes of space: averages, and registration by what the points of each cube look like.

mod downsample;
mod gather;
mod lattice;

pub use downsample::downsample;
