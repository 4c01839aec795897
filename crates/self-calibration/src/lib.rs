#![doc = include_str!("../README.md")]

mod error;
mod networks;

pub use adjust::{GlobalTest, GlobalVerdict, Scale};
pub use error::{Error, Result};
pub use networks::*;
// Of the signatures.
pub use adjust;
pub use camera_model;
pub use error_models;
pub use nalgebra;
pub use orientation;
pub use range_calibration;
