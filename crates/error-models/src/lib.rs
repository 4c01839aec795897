#![doc = include_str!("../README.md")]

mod correction;
mod drift;
mod error;
mod ledger;
mod models;
mod noises;
mod screening;
mod summary;
mod surface;

pub use correction::correct::{correct_frame, correct_raster};
pub use correction::distort::distort_frame;
pub use correction::interpolated::InterpolatedModel;
pub use correction::prepared::{FrameRows, PreparedCorrection};
pub use correction::range_error::RangeCorrection;
pub use drift::frame_rate::FrameRateDrift;
pub use drift::rate_history::{RateHistory, RatePhase};
pub use drift::warm_up::{TemperatureDrift, Transient, WarmUp};
pub use error::Error;
use error::Result;
pub use ledger::{LedgerEntry, OutsideModel, RangeTerm, ledger_maps};
pub use models::hyperbola::HyperbolaJacobian;
pub use models::model::{
    AmplitudeHyperbola, FixedPattern, FurtherShape, FurtherTerms, ImageSurface, ModelSet, PeriodicSpline,
    PolynomialShape, RangeErrorModel, RangePolynomial, RangeTerms, SurfaceShape,
};
pub use models::parameters::{ModelShape, NamedParameter, PARAMETERS, ParameterStatus, parameter_unit};
pub use nalgebra;
pub use noises::noise::{lowest_amplitude, range_sigma_m};
pub use noises::range_noise::{AmplitudeScale, RangeNoise, SharedNoise};
pub use range_image;
pub use range_image::NoiseModel;
pub use screening::beside_edges::sigma_beside_edges;
pub use screening::gross_errors::{FlagCounts, GrossErrorOptions, MixedPixelOptions, flag_gross_errors};
pub use summary::{CorrectionSummary, GroupChange};
