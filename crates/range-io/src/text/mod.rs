//! Text files: opened, bounded, and their faults named.

pub(crate) mod fault;
pub mod limits;
#[cfg(any(feature = "pcd", feature = "ply", feature = "xyz"))]
pub(crate) mod lines;
pub(crate) mod open;
#[cfg(feature = "ron_text")]
pub mod ron_text;
