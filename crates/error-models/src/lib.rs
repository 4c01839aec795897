#![doc = include_str!("../README.md")]

mod error;
mod hyperbola;
mod model;
mod model_set;
mod parameters;
mod range_error;
mod terms;

pub use error::{Error, Result};
pub use hyperbola::HyperbolaJacobian;
pub use model::{AmplitudeHyperbola, FixedPattern, ModelSet, RangeErrorModel, RangeTerms};
pub use parameters::{NamedParameter, PARAMETERS, ParameterStatus};
pub use range_error::RangeCorrection;
