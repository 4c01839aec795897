//! Scans as E57 (ASTM E2807): several clouds in a file, each with its pose in the file's common frame.
//!
//! Points stay in the frame of their scan. A camera's frame has, in E57's images as everywhere in these crates, x to the
//! right, y up and the view along −z, so poses need no turn of axes. Columns and rows are kept as `columnIndex` and
//! `rowIndex`, points that are NaN as invalid ones. Normals follow the extension `nor`; `sigma`, `flags`, `frame` and the
//! covariance have a name space of their own, which other programs pass over.

mod fields;
mod read;
mod write;

use crate::formats::cloud_file::CloudFile;

pub use read::read_e57;
pub use write::write_e57;

/// One scan of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct E57Scan {
    /// Name, such as that of the station; may be empty.
    pub name: String,
    /// Its points, and its pose as `world_from_cloud`.
    pub cloud: CloudFile,
}
