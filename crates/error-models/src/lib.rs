#![doc = include_str!("../README.md")]

mod chunks;
mod correct;
mod distort;
mod error;
mod gross_errors;
mod hyperbola;
mod kernel;
mod mixed_pixels;
mod model;
mod model_set;
mod noise;
mod parameters;
mod range_error;
mod summary;
mod terms;

pub use correct::{correct_frame, correct_raster};
pub use distort::distort_frame;
pub use error::{Error, Result};
pub use gross_errors::{FlagCounts, GrossErrorOptions, MixedPixelOptions, flag_gross_errors};
pub use hyperbola::HyperbolaJacobian;
pub use model::{AmplitudeHyperbola, FixedPattern, ModelSet, RangeErrorModel, RangeTerms};
pub use noise::{lowest_amplitude, range_sigma_m};
pub use parameters::{NamedParameter, PARAMETERS, ParameterStatus};
pub use range_error::RangeCorrection;
pub use range_image::NoiseModel;
pub use summary::{CorrectionSummary, GroupChange};
