#![doc = include_str!("../README.md")]

mod error;
#[cfg(feature = "estimate")]
mod estimate;
mod kernels;
mod outside;
mod restoration;
mod spread;

#[cfg(feature = "estimate")]
pub use adjust;
pub use error::Error;
use error::Result;
#[cfg(feature = "estimate")]
pub use estimate::{
    Ambiguity, Candidate, Capture, CaptureReport, Estimated, EstimationOptions, ForegroundCapture, Nuisance,
    NuisanceValues, PsfEstimate, PsfParameter, TermCount, TermShape, TwoPlaneCapture, Verdict, estimate_psf,
    object_mask, true_phases,
};
pub use kernels::kernel::{GAUSSIAN_CUT_SIGMAS, SampledKernel};
#[cfg(feature = "estimate")]
pub use nalgebra;
pub use outside::{DarkPixels, OutsideLight, OutsideLightDetector, OutsideLightOptions, OutsideLightVerdict, Side};
pub use range_image;
pub use restoration::frame::restore;
pub use restoration::restorer::{RestorationSummary, Restorer};
pub use restoration::rows::ChannelRow;
pub use restoration::scatterer::Scatterer;
pub use spread::composite::{CompositePsf, FieldTerm, Ghost, GhostDelay, GhostPlace};
pub use spread::field::FieldPolynomial;
pub use spread::options::{GridSpacing, Refinement, RestorationOptions, SaturatedLight};
pub use spread::psf::{GaussianTerm, Psf};
