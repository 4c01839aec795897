#![doc = include_str!("../README.md")]

mod borders;
mod brightness;
mod candidates;
mod combine;
mod contraction;
mod cuts;
mod error;
mod forest;
mod grid;
mod intervals;
mod known;
mod labelling;
mod logarithm;
mod multi_frequency;
mod offsets;
mod options;
mod planes;
mod reliability;
mod seams;
mod segments;
mod spatial;
mod steps;
mod surface;
mod temporal;
mod unwrapped;
mod wide;

pub use combine::{Combined, combine_frequencies};
pub use error::{Error, Result};
pub use intervals::combined_interval_m;
pub use multi_frequency::{MultiFrequencyOptions, MultiUnwrapped, unwrap_multi_frequency};
pub use options::{AlbedoPrior, Boundary, EdgeWeight, ImageGeometry, KnownWraps, Seed, SpatialOptions};
pub use spatial::{PhaseInput, Unwrapper, unwrap_spatial};
pub use temporal::{StreamUnwrapper, unwrap_sequence};
pub use unwrapped::{Island, Unwrapped};
