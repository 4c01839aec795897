#![doc = include_str!("../README.md")]

mod amplitude_or_position;
mod calibration;
mod comparison;
mod difference;
mod drift;
mod error;
mod hyperbola_real;
mod hyperbola_start;
mod network;
mod noise;
mod observation;
mod offset_table;
mod options;
mod pattern;
mod plane;
mod planes;
mod planes_geometry;
mod planes_observation;
mod planes_outcome;
mod planes_pixels;
mod planes_problem;
mod planes_reduction;
mod planes_selection;
mod planes_start;
mod primitives;
mod range_terms;
mod surfaces;
mod trends;

pub use adjust::{Distribution, GlobalTest, GlobalVerdict, Scale};
pub use amplitude_or_position::{
    AmplitudeOrPosition, AmplitudeOrPositionOptions, EffectTest, ErrorCause, amplitude_or_position,
};
pub use calibration::RangeCalibration;
pub use comparison::{
    CorrectionComparison, CorrectionDifference, CorrectionSide, DriftComparison, DriftDifference, DriftSide,
    ImageComparison, ImageSide, JointTest, ParameterComparison, ParameterDifference, ParameterSet, compare_corrections,
    compare_drifts, compare_images, compare_parameters,
};
pub use difference::{DifferenceOptions, RangeDifference, differences_to_plane};
pub use drift::*;
pub use error::{Error, Result};
pub use network::*;
pub use noise::*;
pub use offset_table::{OffsetSample, OffsetTable, OffsetTableOptions, estimate_offset_table};
pub use options::{HyperbolaUse, RangeTermOptions, TermUse};
pub use pattern::*;
pub use plane::Plane;
pub use planes::{PlaneCalibrationOptions, PlaneCapture, calibrate_planes};
pub use planes_outcome::{AdjustedPlane, CaptureQuality, PlaneCalibration};
pub use primitives::*;
pub use range_terms::estimate_range_terms;
pub use surfaces::{SurfaceCalibration, SurfaceCalibrationOptions, SurfaceCapture, SurfaceTerm, calibrate_surfaces};
pub use trends::{
    TrendBin, TrendOptions, TrendReport, TrendSample, TrendTest, TrendVariable, TrendVerdict, test_trends,
};
