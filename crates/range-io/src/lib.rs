#![doc = include_str!("../README.md")]

pub mod atomic;
#[cfg(feature = "calibration")]
pub mod calibration;
mod error;

#[cfg(feature = "npz")]
pub mod npz;
#[cfg(feature = "ron_text")]
pub mod ron_text;
#[cfg(feature = "survey")]
pub mod survey;

#[cfg(any(feature = "survey", feature = "calibration"))]
pub(crate) use error::InvalidField;
pub use error::{Error, Result};
