#![doc = include_str!("../README.md")]

pub mod atomic;
#[cfg(feature = "azure")]
pub mod azure;
#[cfg(feature = "calibration")]
pub mod calibration;
mod error;
#[cfg(any(feature = "mkv", feature = "png16", feature = "survey"))]
mod limits;
#[cfg(feature = "mkv")]
pub mod mkv;
#[cfg(feature = "npz")]
pub mod npz;
#[cfg(feature = "ply")]
pub mod ply;
#[cfg(feature = "png16")]
pub mod png16;
#[cfg(feature = "ron_text")]
pub mod ron_text;
#[cfg(feature = "survey")]
pub mod survey;
#[cfg(feature = "tables")]
pub mod tables;
#[cfg(any(feature = "azure", feature = "ron_text", feature = "tables", feature = "trajectory"))]
mod text;
#[cfg(feature = "trajectory")]
pub mod trajectory;

#[cfg(feature = "ron_text")]
pub(crate) use error::InvalidField;
pub use error::{Error, Result};
