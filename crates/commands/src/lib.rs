#![doc = include_str!("../README.md")]

mod destination;
mod error;
mod inertial_data;
pub mod memory;
pub mod plan;
mod progress;
mod record;
pub mod simulate;
mod tape;
pub mod tiles;
mod verdict;

pub use destination::{Inputs, RefusalFile, check_name, json, produce, produce_made, root_of};
pub use error::drift::DriftError;
pub use error::{Error, Result};
pub use inertial_data::{INERTIAL_DATA, INERTIAL_MOUNTING, InertialUnit, read_inertial};
pub use progress::{Progress, Silent};
pub use record::date::today;
pub use record::digest::InputDigest;
pub use record::made;
pub use tape::Tape;
pub use verdict::{Doubt, DoubtKind, Failure, Judged, Verdict, words_about, words_by_subject};
// Of the signatures.
pub use {atomic_output, cloud_tiles, range_io, serde};
