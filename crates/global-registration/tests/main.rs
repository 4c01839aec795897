//! All tests of the crate as one program: linked once, run side by side.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::unwrap_used,
    missing_docs
)]

mod amplitude;
#[path = "../../point-cloud/tests/common/mod.rs"]
mod common;
#[path = "../../projective-registration/tests/depth_frames/mod.rs"]
mod depth_frames;
mod input;
mod painted;
mod pairs;
mod real;
mod scenes;
