//! Distributions, order statistics, scales and several tests at a time.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::float_cmp,
    clippy::unreadable_literal,
    clippy::excessive_precision
)]

mod distributions;
mod multiple_tests;
mod order;
mod robust_scale;
