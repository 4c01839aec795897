//! All tests of the crate as one program: linked once, run side by side.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::unwrap_used,
    missing_docs
)]

#[path = "../../point-cloud/tests/common/mod.rs"]
mod common;
mod depth_frames;
mod frames_cloud;
mod frames_input;
mod frames_real;
mod movers;
mod pairs;
mod prepared;
mod sr4000;
