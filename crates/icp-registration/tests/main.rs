//! All tests of the crate as one program: linked once, run side by side.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::unwrap_used,
    missing_docs
)]

mod bad_input;
mod bad_parts;
mod coincident;
#[path = "../../point-cloud/tests/common/mod.rs"]
mod common;
mod degeneracy;
mod mesh;
mod metric_derivatives;
mod parts;
mod parts_from_outside;
mod real;
mod room;
mod scans;
mod voxels;
