#![doc = include_str!("../README.md")]

mod date;
mod destination;
mod digest;
mod error;
mod inertial_data;
pub mod made;
pub mod plan;
mod progress;
pub mod simulate;
mod tape;
mod verdict;

pub use date::today;
pub use destination::{Inputs, RefusalFile, check_name, json, produce, produce_made, root_of};
pub use digest::InputDigest;
pub use error::drift::DriftError;
pub use error::{Error, Result};
pub use inertial_data::{INERTIAL_DATA, INERTIAL_MOUNTING, InertialUnit, read_inertial};
pub use progress::{Progress, Silent};
pub use tape::Tape;
pub use verdict::{Doubt, DoubtKind, Failure, Judged, Verdict, words_about};
// Of the signatures.
pub use {atomic_output, range_io, serde};
