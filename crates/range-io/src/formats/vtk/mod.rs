//! Point lists in legacy VTK files, ASCII and binary: data sets POLYDATA, `UNSTRUCTURED_GRID` and `STRUCTURED_GRID`.
//!
//! Read are the points, their `NORMALS`, and scalars and fields of the points that are named as in
//! [`crate::formats::cloud_file::CloudFile`]. Cells are passed over. A structured grid of one layer is an organised cloud.

mod read;
mod source;

pub use read::read_vtk;
