#![doc = include_str!("../README.md")]

mod destination;
mod error;
pub mod plan;
mod progress;
mod verdict;

pub use destination::{Inputs, RefusalFile, check_name, json, produce, root_of};
pub use error::drift::DriftError;
pub use error::{Error, Result};
pub use progress::{Progress, Silent};
pub use verdict::{Doubt, DoubtKind, Failure, Judged, Verdict, words_about};
// Of the signatures.
pub use {atomic_output, range_io, serde};
