#![doc = include_str!("../README.md")]

mod absolute;
mod entry;
mod error;
mod exact;
mod filter;
mod frequencies;
mod image;
mod tree;

pub use entry::noisy::{NoisyMethod, NoisyOptions, NoisyUnwrapped, NoisyUnwrapper, unwrap_noisy};
pub use entry::noisy_absolute::unwrap_noisy_absolute;
pub use entry::repair::{
    AmplitudeKind, RepairOptions, RepairVerdict, RepairedDepths, RepairedIsland, RepairedRanges, repair_depths,
    repair_ranges,
};
pub use entry::spatial::{PhaseInput, Unwrapper, unwrap_spatial};
pub use entry::temporal::{StreamUnwrapper, unwrap_sequence};
pub use error::Error;
use error::Result;
pub use exact::{CutPrice, ExactOptions, ExactUnwrapped, LeastCuts, unwrap_least_cuts};
pub use filter::congruent::{congruent, congruent_into};
pub use filter::noise::{LARGEST_SIGMA_RAD, PhaseNoise};
pub use filter::prefilter::{FilterVerdict, Filtered, Prefilter, PrefilterOptions, prefilter};
pub use frequencies::combine::{Combined, CombinedPixels, combine_frequencies, combine_pixels};
pub use frequencies::fold::Fold;
pub use frequencies::hypotheses::{Hypotheses, Hypothesis, RankedHypotheses, hypotheses};
pub use frequencies::intervals::combined_interval_m;
pub use frequencies::kernel_density::{KernelDensityOptions, RowWindow};
pub use frequencies::multi_frequency::{MultiFrequencyOptions, MultiUnwrapped, MultiUnwrapper, unwrap_multi_frequency};
pub use frequencies::rows::PhaseRow;
pub use range_image;
pub use tree::grid::{wrap_step, wrapped};
pub use tree::options::{AlbedoPrior, Boundary, EdgeWeight, ImageGeometry, KnownWraps, Seed, SpatialOptions};
pub use tree::unwrapped::{Island, Unwrapped};
