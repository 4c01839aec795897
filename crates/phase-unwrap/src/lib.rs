#![doc = include_str!("../README.md")]

mod borders;
mod brightness;
mod combine;
mod congruent;
mod error;
mod forest;
mod grid;
mod intervals;
mod known;
mod labelling;
mod multi_frequency;
mod noise;
mod noisy;
mod offsets;
mod options;
mod phasor;
mod planes;
mod prefilter;
mod reliability;
mod segments;
mod spatial;
mod surface;
mod unwrapped;
mod window;

pub use combine::{Combined, combine_frequencies};
pub use congruent::{congruent, congruent_into};
pub use error::{Error, Result};
pub use intervals::combined_interval_m;
pub use multi_frequency::{MultiFrequencyOptions, MultiUnwrapped, unwrap_multi_frequency};
pub use noise::{LARGEST_SIGMA_RAD, PhaseNoise};
pub use noisy::{NoisyOptions, NoisyUnwrapped, NoisyUnwrapper, unwrap_noisy};
pub use options::{AlbedoPrior, ImageGeometry, KnownWraps, Seed, SpatialOptions};
pub use prefilter::{Filtered, Prefilter, PrefilterOptions, prefilter};
pub use spatial::{Unwrapper, unwrap_spatial};
pub use unwrapped::{Island, Unwrapped};
