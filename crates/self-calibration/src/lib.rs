#![doc = include_str!("../README.md")]

mod calibration;
mod difference;
mod error;
mod hyperbola_start;
mod network;
mod observation;
mod options;
mod plane;
mod range_terms;

pub use adjust::Scale;
pub use calibration::RangeCalibration;
pub use difference::{DifferenceOptions, RangeDifference, differences_to_plane};
pub use error::{Error, Result};
pub use network::*;
pub use options::{HyperbolaUse, RangeTermOptions, TermUse};
pub use plane::Plane;
pub use range_terms::estimate_range_terms;
