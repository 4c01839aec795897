#![doc = include_str!("../README.md")]

mod chunks;
mod correct;
mod distort;
mod error;
mod hyperbola;
mod kernel;
mod model;
mod model_set;
mod parameters;
mod range_error;
mod summary;
mod terms;

pub use correct::{correct_frame, correct_raster};
pub use distort::distort_frame;
pub use error::{Error, Result};
pub use hyperbola::HyperbolaJacobian;
pub use model::{AmplitudeHyperbola, FixedPattern, ModelSet, RangeErrorModel, RangeTerms};
pub use parameters::{NamedParameter, PARAMETERS, ParameterStatus};
pub use range_error::RangeCorrection;
pub use summary::{CorrectionSummary, GroupChange};
