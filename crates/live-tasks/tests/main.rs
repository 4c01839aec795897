//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::expect_used, clippy::float_cmp, clippy::panic, clippy::print_stdout, clippy::unwrap_used)]

mod browser;
mod clouds;
mod common;
mod drift;
mod dropping;
mod page;
mod path;
mod recording;
mod refusals;
mod sources;
mod wire;
