//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::expect_used, clippy::float_cmp, clippy::panic, clippy::print_stdout, clippy::unwrap_used)]

#[path = "../../calibration-tasks/tests/calibration_setup.rs"]
mod calibration_setup;
#[path = "../../pipeline/tests/common/mod.rs"]
mod common;
mod compare;
mod explain;
mod exposures;
mod fixed_pattern;
mod frame_rate;
mod live_frames;
mod metamorphic;
mod noise;
mod outputs;
mod real_captures;
mod register;
mod scattering;
mod stored_values;
mod track;
mod warm_up;
mod warm_up_estimate;
mod warming;
