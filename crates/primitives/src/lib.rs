#![doc = include_str!("../README.md")]

mod adjustment;
mod difference;
mod error;
mod fit;
mod judge;
mod linear_start;
mod options;
mod outcome;
mod plane;
mod shape;
mod surface;

pub use adjust;
pub use camera_model;
pub use difference::{DifferenceOptions, RangeDifference, differences_to_plane};
pub use error::Error;
use error::Result;
pub use fit::{fit_primitive, fit_whatever_shape};
pub use nalgebra;
pub use options::PrimitiveOptions;
pub use outcome::{FittedPixel, PrimitiveFit};
pub use plane::Plane;
pub use range_image;
pub use shape::{Primitive, PrimitiveKind};
