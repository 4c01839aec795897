#![doc = include_str!("../README.md")]

mod bending;
mod cholesky;
mod contradiction;
mod detect;
mod error;
mod mixed;
mod model;
mod patches;
mod pixel;
mod profile;
mod radiosity;
mod refine;
mod response;
mod risk;
mod search;
mod single;
mod solver;
mod split;
mod surfaces;
mod two_path;
mod vector;

pub use bending::Bending;
pub use detect::{Detection, DetectionOptions, Detector, Evidence, detect};
pub use error::{Error, Result};
pub use mixed::{
    ComplexImage, MixedPixelTreatment, MixedPixels, NotSplit, SplitOptions, SplitPixel, SurfacePoint,
    treat_mixed_pixels,
};
pub use pixel::{MAXIMUM_FREQUENCIES, Systematics};
pub use response::{FrequencyResponse, ResponseEstimate, estimate_response};
pub use risk::{AlbedoScale, Risk, RiskEvidence, RiskOptions, assess_risk, ranges_from_depths};
pub use search::SearchSpan;
pub use two_path::{
    Hypothesis, PixelHypotheses, PixelPaths, TwoPathImage, TwoPathOptions, TwoPathSolver, Verdict, solve_two_paths,
};
