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
#[path = "../../projective-registration/tests/depth_frames/mod.rs"]
mod depth_frames;
mod hand_held;
mod imu;
mod invalid;
mod motions_of_a_unit;
mod paths;
#[path = "../../projective-registration/tests/prepared/mod.rs"]
mod prepared;
mod sequence;
mod shared_error;
mod trajectory;
