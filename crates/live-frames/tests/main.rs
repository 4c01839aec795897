//! The tests of the crate, one suite.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::float_cmp, clippy::panic, clippy::print_stdout)]

#[allow(dead_code)] // examples take the rest of it
mod common;
mod exchange;
mod latest;
mod memory;
mod refusals;
mod same_as_stages;
mod sequences;
#[cfg(feature = "tracking")]
mod tracking;
