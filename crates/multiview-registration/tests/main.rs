//! All tests of the crate as one program: linked once, run side by side.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::unwrap_used,
    missing_docs
)]

mod buildings;
#[path = "../../point-cloud/tests/common/mod.rs"]
mod common;
#[path = "../../projective-registration/tests/depth_frames/mod.rs"]
mod depth_frames;
mod frames;
mod input;
mod model;
mod placement;
mod real;
#[path = "../../tracking/tests/sequence/mod.rs"]
mod sequence;
#[path = "../../projective-registration/tests/sr4000/mod.rs"]
mod sr4000;
mod stations;
mod turns;
