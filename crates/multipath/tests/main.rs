//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::expect_used, clippy::panic, clippy::print_stderr, clippy::unwrap_used)]

mod common;
mod detection;
mod mixed;
mod real_capture;
mod risk;
mod two_path;
