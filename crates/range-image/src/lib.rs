#![doc = include_str!("../README.md")]

mod error;
mod flags;
mod frame;
mod image_format;
mod modulation;
mod raster;

pub use error::{Error, Result};
pub use flags::Flags;
pub use frame::{ComplexChannel, ComplexFrame, RangeFrame, RawFrame, Samples};
pub use image_format::ImageFormat;
pub use modulation::{Modulation, SPEED_OF_LIGHT};
pub use raster::Raster;
