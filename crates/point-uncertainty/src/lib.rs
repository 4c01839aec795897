#![doc = include_str!("../README.md")]

mod common;
mod error;
mod propagate;
mod shared_error;
mod station;

pub use camera_model;
pub use common::{CommonError, CommonErrors, Source};
pub use error::Error;
use error::Result;
pub use error_models;
pub use nalgebra;
pub use propagate::{Gradient, PointErrors, Shares, covariance, point_covariance, shares};
pub use shared_error::SharedErrorGrid;
pub use station::{Columns, SharedBySensor, StationErrors};
