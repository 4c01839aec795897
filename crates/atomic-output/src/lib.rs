#![doc = include_str!("../README.md")]

mod contents;
mod destination;
mod disk;
mod error;
mod exchange;
mod file;
mod folder;
mod leftovers;

pub use destination::Destination;
#[cfg(feature = "fault-injection")]
#[doc(hidden)]
pub use disk::fault;
pub use error::Error;
use error::Result;
pub use file::{FileWriter, write_text};
pub use folder::OutputFolder;
