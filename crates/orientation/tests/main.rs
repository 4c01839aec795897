//! Stations, views, networks and mountings against the truth. Measured figures are shown with `--show-output`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)]

mod common;
mod identification;
mod mounting;
mod names;
mod network;
mod resection;
mod surveys;
mod two_views;
