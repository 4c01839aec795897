#![doc = include_str!("../README.md")]

mod calibration;
mod difference;
mod error;
mod hyperbola_start;
mod network;
mod noise;
mod observation;
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

pub use adjust::Scale;
pub use calibration::RangeCalibration;
pub use difference::{DifferenceOptions, RangeDifference, differences_to_plane};
pub use error::{Error, Result};
pub use network::*;
pub use noise::*;
pub use options::{HyperbolaUse, RangeTermOptions, TermUse};
pub use pattern::*;
pub use plane::Plane;
pub use planes::{PlaneCalibrationOptions, PlaneCapture, calibrate_planes};
pub use planes_outcome::{AdjustedPlane, CaptureQuality, PlaneCalibration};
pub use primitives::*;
pub use range_terms::estimate_range_terms;
pub use surfaces::{SurfaceCalibration, SurfaceCalibrationOptions, SurfaceCapture, SurfaceTerm, calibrate_surfaces};
