//! All tests of the crate as one program: linked once, run side by side.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    clippy::print_stdout,
    clippy::unwrap_used,
    missing_docs
)]

mod absolute_orientation;
mod bad_input;
mod bad_parts;
mod closed_forms;
mod coarse;
mod coarse_amplitude;
mod coarse_input;
mod coarse_real;
mod coarse_scenes;
mod coincident;
mod common;
mod degeneracy;
mod depth_frames;
mod mesh;
mod metric_derivatives;
mod multiview;
mod multiview_frames;
mod multiview_input;
mod multiview_model;
mod multiview_placement;
mod multiview_real;
mod neighbours;
mod normals;
mod organised;
mod organised_cloud;
mod organised_input;
mod organised_invalid;
mod organised_real;
mod parts;
mod parts_from_outside;
mod real;
mod room;
#[path = "common/scans.rs"]
mod scans;
mod sequence;
mod shared_error;
mod sr4000;
mod tracking;
mod tracking_imu;
mod trajectory;
mod voxels;
