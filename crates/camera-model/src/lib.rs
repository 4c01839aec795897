#![doc = include_str!("../README.md")]

mod camera;
mod error;

pub use camera::{Camera, InteriorOrientation, LensDistortion};
pub use error::{Error, Result};
pub use range_image::ImageFormat;
