#![doc = include_str!("../README.md")]

mod convolution;
mod error;
mod frame;
mod grid;
mod kernel;
mod mask;
mod model;
mod options;
mod psf;
mod restorer;
mod scatterer;
mod sigma;
mod spectrum;

pub use error::{Error, Result};
pub use frame::restore;
pub use kernel::{GAUSSIAN_CUT_SIGMAS, SampledKernel};
pub use options::{GridSpacing, RestorationOptions};
pub use psf::{GaussianTerm, Psf};
pub use restorer::{RestorationSummary, Restorer};
pub use scatterer::Scatterer;
