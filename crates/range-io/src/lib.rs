#![doc = include_str!("../README.md")]
// Formats share helpers: what is used of them depends on the features.
#![cfg_attr(not(feature = "clouds"), allow(dead_code, unused_imports))]

#[cfg(feature = "calibration")]
pub mod calibration;
mod error;
mod formats;
#[cfg(any(feature = "e57", feature = "pcd", feature = "ply", feature = "trajectory"))]
mod pose;
#[cfg(feature = "survey")]
pub mod survey;
#[cfg(feature = "tables")]
pub mod tables;
mod text;
#[cfg(feature = "trajectory")]
pub mod trajectory;

pub use atomic_output;
#[cfg(any(feature = "calibration", feature = "survey", feature = "tables", feature = "trajectory"))]
pub use camera_model;
pub use error::Error;
#[cfg(any(feature = "survey", feature = "calibration"))]
pub(crate) use error::InvalidField;
use error::Result;
#[cfg(feature = "calibration")]
pub use error_models;
#[cfg(feature = "azure")]
pub use formats::azure;
#[cfg(any(feature = "e57", feature = "pcd", feature = "ply", feature = "vtk", feature = "xyz"))]
/// Point clouds of any format: what a file can hold, and readers and writers that go by content and ending.
pub mod clouds {
    #[cfg(feature = "clouds")]
    pub use crate::formats::any_cloud::{CloudFormat, read_any_cloud, write_any_cloud};
    pub use crate::formats::cloud_file::{CloudFile, Precision};
}
#[cfg(feature = "e57")]
pub use formats::e57;
#[cfg(feature = "grey")]
pub use formats::images::grey;
#[cfg(feature = "png16")]
pub use formats::images::png16;
#[cfg(feature = "mkv")]
pub use formats::mkv;
#[cfg(feature = "npz")]
pub use formats::npz;
#[cfg(feature = "pcd")]
pub use formats::pcd;
#[cfg(feature = "ply")]
pub use formats::ply;
#[cfg(feature = "vtk")]
pub use formats::vtk;
#[cfg(feature = "xyz")]
pub use formats::xyz;
#[cfg(any(
    feature = "calibration",
    feature = "e57",
    feature = "pcd",
    feature = "ply",
    feature = "tables",
    feature = "trajectory",
    feature = "vtk",
    feature = "xyz"
))]
pub use nalgebra;
#[cfg(any(feature = "calibration", feature = "grey", feature = "mkv", feature = "png16", feature = "survey"))]
pub use range_image;
#[cfg(feature = "calibration")]
pub use scattering_deconvolution;
pub use text::limits;
pub use text::open::{open, read_bytes, read_ron_text, read_text};
#[cfg(feature = "ron_text")]
pub use text::ron_text;
