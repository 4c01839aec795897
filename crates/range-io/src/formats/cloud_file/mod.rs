//! What a file of a point cloud can hold, and the columns that formats share.

#[cfg(any(feature = "pcd", feature = "ply", feature = "vtk", feature = "xyz"))]
mod columns;
mod file;
#[cfg(any(feature = "pcd", feature = "ply"))]
mod layout;

#[cfg(any(feature = "pcd", feature = "ply", feature = "vtk", feature = "xyz"))]
pub(crate) use columns::{Columns, canonical};
#[cfg(feature = "e57")]
pub(crate) use file::COVARIANCE;
#[cfg(any(feature = "e57", feature = "pcd", feature = "ply"))]
pub(crate) use file::value_error;
pub use file::{CloudFile, Precision};
#[cfg(any(feature = "pcd", feature = "ply"))]
pub(crate) use layout::{Kind, properties, put_point};
