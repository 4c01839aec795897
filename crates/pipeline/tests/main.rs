//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::expect_used, clippy::float_cmp, clippy::panic, clippy::print_stdout, clippy::unwrap_used)]

mod ambiguous_light;
mod bad_input;
mod calibrate;
mod calibrate_bad_input;
mod calibrate_contradictions;
mod calibrate_offset;
mod calibrate_planes;
mod calibrate_warm_up;
mod certificate;
mod common;
mod compare;
mod diff;
mod documented_files;
mod explain;
mod exposures;
mod false_flags;
mod fixed_pattern;
mod frame_rate;
mod hostile_files;
mod metamorphic;
mod noise;
mod outputs;
mod outside_light;
mod real_captures;
mod real_periodic;
mod real_repeats;
mod register;
mod remaining_errors;
mod right_flags;
mod room;
mod scattering;
mod track;
mod warm_up;
mod warm_up_estimate;
#[path = "common/warming.rs"]
mod warming;
