#![doc = include_str!("../README.md")]

mod borders;
mod brightness;
mod error;
mod forest;
mod grid;
mod labelling;
mod offsets;
mod options;
mod reliability;
mod segments;
mod spatial;
mod surface;
mod unwrapped;

pub use error::{Error, Result};
pub use options::{AlbedoPrior, KnownWraps, Seed, SpatialOptions};
pub use spatial::{Unwrapper, unwrap_spatial};
pub use unwrapped::{Island, Unwrapped};
