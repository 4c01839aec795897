#![doc = include_str!("../README.md")]

mod assemble;
mod calibrated;
mod error;
mod file;
mod sensitivity;

pub use assemble::{Frame, Registered, common_errors};
pub use calibrated::Corrected;
pub use error::Error;
use error::Result;
pub use file::{CommonErrorsFile, FrameErrors};
pub use multiview_registration;
pub use nalgebra;
pub use point_cloud;
pub use point_uncertainty::{self, SharedBySensor};
pub use range_io;
