//! Point clouds as PCD 0.7: read as `ascii`, `binary` and `binary_compressed`, written as `binary`.
//!
//! Fields that are written and recognised are those of [`crate::formats::cloud_file::CloudFile`], normals as
//! `normal_x normal_y normal_z`; other fields are left alone. `WIDTH` and `HEIGHT` give columns and rows where the height
//! is more than 1, `VIEWPOINT` the pose of the points, which stay in the frame of the sensor.

mod header;
mod lzf;
mod read;
mod write;

pub use read::read_pcd;
pub use write::write_pcd;
