//! Outputs that are never half, and never in place of what they were made from.
//!
//! [`FileWriter`] writes one file and [`OutputFolder`] a folder of results: beside their place, brought to the disk, and
//! then renamed into it, so that neither a crash of the program nor a loss of power leaves a mixture. A folder of results
//! is opened through its [`Destination`], which can't be made without naming what is read and refuses to write there.

mod contents;
mod destination;
mod disk;
mod exchange;
mod file;
mod folder;
mod leftovers;

pub use destination::Destination;
#[cfg(feature = "fault-injection")]
#[doc(hidden)]
pub use disk::fault;
pub use file::{FileWriter, write_text};
pub use folder::OutputFolder;
