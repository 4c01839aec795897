//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::expect_used, clippy::panic, clippy::print_stdout, clippy::unwrap_used)]

mod common;
mod covariance;
mod files;
mod footprints;
mod frames;
mod jacobians;
mod kinect2_rays;
mod plumb_bob;
mod poses;
mod rational;
mod round_trips;
