#![doc = include_str!("../README.md")]

mod common;
mod error;
mod fuse;
mod input;
mod lattice;
mod options;
mod outcome;
mod patches;
mod sight;
mod small;
mod surfels;

pub use error::Error;
use error::Result;
pub use fuse::fuse;
pub use input::Registered;
pub use nalgebra;
pub use options::{CommonErrorUse, FusionOptions};
pub use outcome::{Apart, Contradiction, Fused, Reason, SharedError, Surfel, Unfused};
pub use point_uncertainty;
