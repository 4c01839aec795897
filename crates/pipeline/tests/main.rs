//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::expect_used, clippy::float_cmp, clippy::panic, clippy::print_stdout, clippy::unwrap_used)]

mod ambiguous_light;
mod bad_input;
mod common;
mod false_flags;
mod outside_light;
mod parts;
mod real_periodic;
mod real_repeats;
mod refused;
mod remaining_errors;
mod right_flags;
