#![doc = include_str!("../README.md")]

mod blobs;
mod composite;
mod convolution;
mod dependence;
mod error;
mod field;
#[cfg(feature = "estimate")]
mod estimate;
mod frame;
mod grid;
mod kernel;
mod mask;
mod model;
mod noise;
mod operator;
mod options;
mod parts;
mod psf;
mod restorer;
mod scatterer;
mod sigma;
mod spectrum;
mod work;

pub use composite::{CompositePsf, FieldTerm, Ghost, GhostDelay, GhostPlace};
pub use error::{Error, Result};
pub use field::FieldPolynomial;
#[cfg(feature = "estimate")]
pub use estimate::{
    Ambiguity, Candidate, Capture, CaptureReport, Estimated, EstimationOptions, ForegroundCapture, Nuisance,
    NuisanceValues, PsfEstimate, PsfParameter, TermCount, TermShape, TwoPlaneCapture, Verdict, estimate_psf,
    object_mask, true_phases,
};
pub use frame::restore;
pub use kernel::{GAUSSIAN_CUT_SIGMAS, SampledKernel};
pub use options::{GridSpacing, RestorationOptions, SaturatedLight};
pub use psf::{GaussianTerm, Psf};
pub use restorer::{RestorationSummary, Restorer};
pub use scatterer::Scatterer;
