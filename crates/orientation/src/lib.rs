#![doc = include_str!("../README.md")]

mod approximation;
mod error;
mod linearity;
mod model;
mod resection;
mod target;
mod three_points;

pub use adjust;
pub use approximation::approximate_poses;
pub use camera_model;
pub use error::Error;
use error::Result;
pub use nalgebra;
pub use resection::{Resection, ResectionOptions, Start, TargetResidual, resect};
pub use target::{ObservedRange, TargetObservation};
