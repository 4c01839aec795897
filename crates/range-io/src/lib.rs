#![doc = include_str!("../README.md")]

pub mod atomic;
#[cfg(feature = "azure")]
pub mod azure;
#[cfg(feature = "calibration")]
pub mod calibration;
#[cfg(any(feature = "e57", feature = "pcd", feature = "ply", feature = "vtk", feature = "xyz"))]
pub mod clouds;
#[cfg(feature = "e57")]
pub mod e57;
mod error;
mod fault;
pub mod limits;
#[cfg(any(feature = "pcd", feature = "ply", feature = "xyz"))]
mod lines;
#[cfg(feature = "mkv")]
pub mod mkv;
#[cfg(feature = "npz")]
pub mod npz;
mod open;
#[cfg(feature = "pcd")]
pub mod pcd;
#[cfg(feature = "ply")]
pub mod ply;
#[cfg(feature = "png16")]
pub mod png16;
#[cfg(any(feature = "e57", feature = "pcd", feature = "ply", feature = "trajectory"))]
mod pose;
#[cfg(feature = "ron_text")]
pub mod ron_text;
#[cfg(feature = "survey")]
pub mod survey;
#[cfg(feature = "tables")]
pub mod tables;
#[cfg(feature = "trajectory")]
pub mod trajectory;
#[cfg(feature = "vtk")]
pub mod vtk;
#[cfg(feature = "xyz")]
pub mod xyz;

#[cfg(any(feature = "survey", feature = "calibration"))]
pub(crate) use error::InvalidField;
pub use error::{Error, Result};
pub use open::{open, read_bytes, read_ron_text, read_text};
