#![doc = include_str!("../README.md")]

mod calibration;
mod camera;
mod carried;
mod error;
mod frame;
mod latest;
mod processor;
mod stages;
mod work;

pub use calibration::PreparedCalibration;
pub use camera::{Exposure, LiveCamera};
pub use camera_model;
pub use carried::{CarriedUnwrapper, CarryOptions, CarrySummary, WholeFrame};
pub use error::Error;
pub use error_models;
pub use frame::ProcessedFrame;
pub use latest::{FrameReader, FrameWriter, latest_frame};
pub use phase_unwrap;
pub use processor::Processor;
pub use range_image;
pub use range_io;
pub use stages::{DeconvolveStage, DriftStage, Limits, Stages, UnwrapStage};
#[cfg(feature = "tracking")]
pub use tracking;
