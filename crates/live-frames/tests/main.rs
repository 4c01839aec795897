//! The tests of the crate, one suite.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::float_cmp, clippy::panic, clippy::print_stdout)]

mod carried;
#[allow(dead_code)] // examples take the rest of it
mod common;
mod exchange;
mod latest;
mod memory;
// Scenes that phases are unwrapped of.
#[path = "../../phase-unwrap/tests/common/mod.rs"]
mod moving_scene;
mod refusals;
mod same_as_stages;
mod sequences;
#[cfg(feature = "tracking")]
mod tracking;
