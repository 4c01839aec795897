#![doc = include_str!("../README.md")]

mod error;
mod model;

pub use error::{Error, Result};
pub use model::{AmplitudeHyperbola, FixedPattern, ModelSet, RangeErrorModel, RangeTerms};
