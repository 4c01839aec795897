#![doc = include_str!("../README.md")]

mod chunks;
mod correct;
mod distort;
mod error;
mod frame_rate;
mod further;
mod gross_errors;
mod hyperbola;
mod interpolated;
mod inverse;
mod kernel;
mod kernel_further;
mod kernel_sines;
mod kernel_tally;
mod ledger;
mod legendre;
mod linear;
mod mixed_pixels;
mod model;
mod model_set;
mod noise;
mod parameters;
mod plane_block;
mod polynomial;
mod range_error;
mod range_noise;
mod rate_history;
mod spline;
mod steepest;
mod straight_line;
mod summary;
mod surface;
mod terms;
mod warm_up;

pub use correct::{correct_frame, correct_raster};
pub use distort::distort_frame;
pub use error::{Error, Result};
pub use frame_rate::FrameRateDrift;
pub use gross_errors::{FlagCounts, GrossErrorOptions, MixedPixelOptions, flag_gross_errors};
pub use hyperbola::HyperbolaJacobian;
pub use interpolated::InterpolatedModel;
pub use ledger::{LedgerEntry, OutsideModel, RangeTerm, ledger_maps};
pub use model::{
    AmplitudeHyperbola, FixedPattern, FurtherShape, FurtherTerms, ImageSurface, ModelSet, PeriodicSpline,
    PolynomialShape, RangeErrorModel, RangePolynomial, RangeTerms, SurfaceShape,
};
pub use noise::{lowest_amplitude, range_sigma_m};
pub use parameters::{ModelShape, NamedParameter, PARAMETERS, ParameterStatus, parameter_unit};
pub use range_error::RangeCorrection;
pub use range_image::NoiseModel;
pub use range_noise::{AmplitudeScale, RangeNoise};
pub use rate_history::{RateHistory, RatePhase};
pub use summary::{CorrectionSummary, GroupChange};
pub use warm_up::{TemperatureDrift, Transient, WarmUp};
