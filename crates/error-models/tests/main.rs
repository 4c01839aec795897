//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::expect_used, clippy::float_cmp, clippy::panic, clippy::unwrap_used)]

mod beside_edges;
mod frame_rate;
mod frames;
mod further;
mod gross_errors;
mod integration_times;
mod ledger;
mod models;
mod noise;
mod parameters;
mod range_noise;
mod warm_up;
