#![doc = include_str!("../README.md")]

mod comparison;
mod error;
mod trends;

pub use camera_model;
pub use comparison::{
    CorrectionComparison, CorrectionDifference, CorrectionSide, DriftComparison, DriftDifference, DriftSide,
    ImageComparison, ImageSide, JointTest, ParameterComparison, ParameterDifference, ParameterSet, compare_corrections,
    compare_drifts, compare_images, compare_parameters,
};
pub use error::Error;
use error::Result;
pub use error_models;
pub use nalgebra;
pub use range_image;
pub use trends::{
    TrendBin, TrendOptions, TrendReport, TrendSample, TrendTest, TrendVariable, TrendVerdict, test_trends,
};
