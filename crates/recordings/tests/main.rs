//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::expect_used, clippy::float_cmp, clippy::panic, clippy::print_stdout, clippy::unwrap_used)]

#[cfg(feature = "adi")]
mod adi;
#[cfg(feature = "bag")]
mod bag;
mod common;
#[cfg(all(feature = "adi", feature = "bag", feature = "mcap", feature = "mkv"))]
mod hostile;
mod images;
#[cfg(feature = "mcap")]
mod mcap;
#[cfg(feature = "mkv")]
mod mkv;
