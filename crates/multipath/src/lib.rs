#![doc = include_str!("../README.md")]

mod error;
mod mixture;
mod numbers;
mod pixels;
mod scene;

pub use error::Error;
use error::Result;
pub use mixture::mixed::{
    ComplexImage, MixedPixelTreatment, MixedPixels, NotSplit, SplitOptions, SplitPixel, SurfacePoint,
    treat_mixed_pixels,
};
pub use pixels::pixel::{MAXIMUM_FREQUENCIES, Systematics};
pub use pixels::response::{FrequencyResponse, ResponseEstimate, estimate_response};
pub use pixels::search::SearchSpan;
pub use pixels::two_path::{
    Hypothesis, PixelHypotheses, PixelPaths, TwoPathImage, TwoPathOptions, TwoPathSolver, Verdict, solve_two_paths,
};
pub use range_image;
pub use scene::bending::Bending;
pub use scene::detect::{Detection, DetectionOptions, Detector, Evidence, detect};
pub use scene::risk::{AlbedoScale, Risk, RiskEvidence, RiskOptions, assess_risk, ranges_from_depths};
