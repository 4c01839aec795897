//! All tests of the crate as one program.
#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

mod derivatives;
mod kernel;
mod observations;
mod rigid_pose;
