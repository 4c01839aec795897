//! All tests of the crate as one program: linked once, run side by side.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::type_complexity,
    clippy::unwrap_used,
    missing_docs
)]

mod boards;
mod print;
mod ranges;
mod singles;
// Boards rendered with their truth.
#[path = "../../targets/tests/support/mod.rs"]
mod support;
