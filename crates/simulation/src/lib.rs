#![doc = include_str!("../README.md")]

mod error;
mod light;
mod random;
mod render;
mod samples;
mod scene;
mod simulate;
mod spec;
mod truth;

pub use camera_model;
pub use error::Error;
use error::Result;
pub use error_models;
pub use nalgebra;
pub use range_image;
pub use scattering_deconvolution;
pub use simulate::{SimulatedFrame, SimulatedSurvey, Simulator, StationImage, simulate, simulate_frame};
pub use spec::SimulationSpec;
pub use spec::camera::{
    CameraSpec, ExposureSpec, IlluminationSpec, IntervalChange, ReferencePathSpec, TemperatureSpec,
};
pub use spec::errors::{
    DigitisationSpec, ErrorsSpec, FixedPatternSpec, GrossErrorsSpec, MixedPixelsSpec, MultipathSpec, SampleType,
};
pub use spec::scene::{ObjectSpec, SceneSpec, ShapeSpec, TextureSpec};
pub use spec::station::{AttitudeSpec, StationSpec};
pub use truth::FrameTruth;
