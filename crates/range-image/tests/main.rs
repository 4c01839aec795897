//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::expect_used, clippy::panic, clippy::print_stderr, clippy::print_stdout, clippy::unwrap_used)]

mod common;
mod consistency;
mod demodulation;
mod fusion;
mod harmonics;
mod interference;
mod mean_flags;
mod noise;
mod real_capture;
mod rest;
mod wide_loops;
