//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::expect_used, clippy::float_cmp, clippy::panic, clippy::print_stdout, clippy::unwrap_used)]

mod calibrate;
mod calibrate_bad_input;
mod calibrate_contradictions;
mod calibrate_offset;
mod calibrate_planes;
mod calibrate_warm_up;
mod calibration_setup;
mod certificate;
#[path = "../../pipeline/tests/common/mod.rs"]
mod common;
mod diff;
mod documented_files;
mod hostile_files;
mod room;
mod surfaces;
