#![doc = include_str!("../README.md")]

pub mod atomic;
mod error;

#[cfg(feature = "npz")]
pub mod npz;
#[cfg(feature = "ron_text")]
pub mod ron_text;
#[cfg(feature = "survey")]
pub mod survey;

pub use error::{Error, Result};
#[cfg(any(feature = "survey", feature = "calibration"))]
pub(crate) use error::InvalidField;
