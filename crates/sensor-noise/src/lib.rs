#![doc = include_str!("../README.md")]

mod error;
mod noise;
mod pattern;

pub use error::{Error, Result};
pub use noise::*;
pub use pattern::*;
