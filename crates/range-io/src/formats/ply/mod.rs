//! Point clouds as PLY: written binary little-endian block by block, read in all three encodings.
//!
//! Properties that are written (colours, `red green blue`, too) and recognised: `x y z`, `nx ny nz`, `intensity`, `sigma`, `flags`, `frame` and the six
//! covariance terms `cov_xx cov_xy cov_xz cov_yy cov_yz cov_zz`. A prefix `scalar_` and capitals, as other programs write
//! them, are read too; other properties of the vertices, and other elements, are left alone. Columns and rows of an
//! organised cloud stand in `obj_info num_cols` and `num_rows`, as in range grids, its pose in
//! `obj_info world_from_cloud tx ty tz qx qy qz qw`.

mod header;
mod read;
mod write;

pub use crate::formats::cloud_file::{CloudFile, Precision};
pub use read::{read_cloud, read_some_of_cloud};
pub use write::{PlyWriter, write_cloud};
