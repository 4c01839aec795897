//! Random errors from repeated frames (Sect. 4): noise of the samples, noise of ranges, and whether a sigma is true.

mod bins;
mod captures;
mod check;
mod fit;
mod neighbours;
mod options;
mod ranges;
mod repeats;
mod samples;
mod steadiness;

pub use bins::VarianceBin;
pub use captures::{Frames, RepeatedRanges, RepeatedSamples};
pub use check::{SigmaBin, SigmaCheck, SigmaVerdict, check_complex_sigma, check_range_sigma};
pub use fit::{VarianceEstimator, VarianceFit};
pub use options::{NoiseFitOptions, SampleUnits};
pub use ranges::{RangeNoiseEstimate, estimate_range_noise};
pub use samples::{SampleNoiseEstimate, estimate_sample_noise};
pub use steadiness::Steadiness;
