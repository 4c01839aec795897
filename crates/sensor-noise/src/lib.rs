#![doc = include_str!("../README.md")]

mod error;
mod noise;
mod pattern;

pub use adjust;
pub use camera_model;
pub use error::Error;
use error::Result;
pub use error_models;
pub use noise::*;
pub use pattern::*;
pub use primitives;
pub use range_image;
