#![doc = include_str!("../README.md")]

mod bends;
mod borders;
mod brightness;
mod candidates;
mod combine;
mod congruent;
mod continuity;
mod contraction;
mod cuts;
mod error;
mod exact;
mod fold;
mod forest;
mod frame;
mod fringes;
mod grid;
mod hypotheses;
mod intervals;
mod kernel_density;
mod known;
mod labelling;
mod lanes;
mod lattice;
mod logarithm;
mod multi_frequency;
mod noise;
mod noisy;
mod noisy_absolute;
mod offsets;
mod options;
mod phasor;
mod planes;
mod prefilter;
mod reliability;
mod repair;
mod seams;
mod segments;
mod spatial;
mod steps;
mod surface;
mod temporal;
mod unwrapped;
mod window;

pub use combine::{Combined, combine_frequencies};
pub use congruent::{congruent, congruent_into};
pub use error::{Error, Result};
pub use exact::{CutPrice, ExactOptions, ExactUnwrapped, LeastCuts, unwrap_least_cuts};
pub use fold::Fold;
pub use hypotheses::{Hypotheses, Hypothesis, RankedHypotheses, hypotheses};
pub use intervals::combined_interval_m;
pub use kernel_density::KernelDensityOptions;
pub use multi_frequency::{MultiFrequencyOptions, MultiUnwrapped, MultiUnwrapper, unwrap_multi_frequency};
pub use noise::{LARGEST_SIGMA_RAD, PhaseNoise};
pub use noisy::{NoisyMethod, NoisyOptions, NoisyUnwrapped, NoisyUnwrapper, unwrap_noisy};
pub use noisy_absolute::unwrap_noisy_absolute;
pub use options::{AlbedoPrior, Boundary, EdgeWeight, ImageGeometry, KnownWraps, Seed, SpatialOptions};
pub use prefilter::{FilterVerdict, Filtered, Prefilter, PrefilterOptions, prefilter};
pub use repair::{
    AmplitudeKind, RepairOptions, RepairVerdict, RepairedDepths, RepairedIsland, RepairedRanges, repair_depths,
    repair_ranges,
};
pub use spatial::{PhaseInput, Unwrapper, unwrap_spatial};
pub use temporal::{StreamUnwrapper, unwrap_sequence};
pub use unwrapped::{Island, Unwrapped};
