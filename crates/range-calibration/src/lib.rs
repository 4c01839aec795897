#![doc = include_str!("../README.md")]

mod by_planes;
mod error;
mod observed;
mod ranges;
mod surfaces;

pub use adjust;
pub use adjust::Scale;
pub use by_planes::planes::{PlaneCalibrationOptions, PlaneCapture, calibrate_planes};
pub use by_planes::planes_outcome::{AdjustedPlane, CaptureQuality, PlaneCalibration};
pub use camera_model;
pub use error::Error;
use error::Result;
pub use error_models;
pub use multiview_registration;
pub use nalgebra;
pub use observed::calibration::RangeCalibration;
pub use observed::hyperbola_start::{hyperbola_gain, hyperbola_start};
pub use observed::options::{HyperbolaUse, RangeTermOptions, TermUse};
pub use point_cloud;
pub use primitives;
pub use primitives::{DifferenceOptions, Plane, RangeDifference, differences_to_plane};
pub use range_image;
pub use ranges::amplitude_or_position::{
    AmplitudeOrPosition, AmplitudeOrPositionOptions, EffectTest, ErrorCause, amplitude_or_position,
};
pub use ranges::offset_table::{OffsetSample, OffsetTable, OffsetTableOptions, estimate_offset_table};
pub use ranges::range_terms::estimate_range_terms;
pub use surfaces::{
    HeldTerm, SurfaceCalibration, SurfaceCalibrationOptions, SurfaceCapture, SurfaceTerm, calibrate_surfaces,
};
