#![doc = include_str!("../README.md")]

mod error;
mod networks;

pub use adjust::{GlobalTest, GlobalVerdict, Scale};
pub use error::{Error, Result};
pub use networks::*;
// Its error is one of this crate's.
pub use range_calibration;
