//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::expect_used, clippy::panic, clippy::print_stderr, clippy::unwrap_used)]

mod common;
mod consistency;
mod demodulation;
mod harmonics;
mod noise;
mod real_capture;
mod rest;
mod wide_loops;
