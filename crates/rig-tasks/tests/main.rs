//! Rigs from files to files.
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs, dead_code)]

#[path = "../../rig-calibration/tests/support/rigs.rs"]
mod rigs;

mod calibrate;
mod colour;
