//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::expect_used, clippy::float_cmp, clippy::panic, clippy::unwrap_used)]

mod calibration;
mod clouds;
mod common;
mod grey;
mod hostile;
mod images;
mod npz;
mod ply;
#[path = "common/scratch.rs"]
mod scratch;
mod survey;
mod tables;
mod trajectory;
