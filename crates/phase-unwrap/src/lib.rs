#![doc = include_str!("../README.md")]

mod borders;
mod brightness;
mod combine;
mod continuity;
mod error;
mod fold;
mod forest;
mod frame;
mod grid;
mod hypotheses;
mod intervals;
mod kernel_density;
mod known;
mod labelling;
mod lanes;
mod lattice;
mod multi_frequency;
mod offsets;
mod options;
mod planes;
mod reliability;
mod repair;
mod segments;
mod spatial;
mod surface;
mod unwrapped;

pub use combine::{Combined, combine_frequencies};
pub use error::{Error, Result};
pub use fold::Fold;
pub use hypotheses::{Hypotheses, Hypothesis, RankedHypotheses, hypotheses};
pub use intervals::combined_interval_m;
pub use kernel_density::KernelDensityOptions;
pub use multi_frequency::{MultiFrequencyOptions, MultiUnwrapped, MultiUnwrapper, unwrap_multi_frequency};
pub use options::{AlbedoPrior, ImageGeometry, KnownWraps, Seed, SpatialOptions};
pub use repair::{
    AmplitudeKind, RepairOptions, RepairVerdict, RepairedDepths, RepairedIsland, RepairedRanges, repair_depths,
    repair_ranges,
};
pub use spatial::{Unwrapper, unwrap_spatial};
pub use unwrapped::{Island, Unwrapped};
