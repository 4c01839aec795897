//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::expect_used, clippy::float_cmp, clippy::panic, clippy::print_stdout, clippy::unwrap_used)]

mod bad_input;
#[path = "common/bal.rs"]
#[allow(dead_code)] // What the examples use of it.
mod bal;
mod checkerboard;
mod common;
mod datum_change;
mod descend;
mod differentiated;
#[path = "common/differentiated_camera.rs"]
mod differentiated_camera;
mod display;
mod elimination;
mod global_test;
mod iteration;
mod linear;
mod network;
mod nist_strd;
#[path = "../examples/checkerboard/plumb_bob.rs"]
mod plumb_bob;
#[path = "common/range_camera.rs"]
#[allow(dead_code)]
mod range_camera;
mod robust;
mod snooping;
#[path = "../examples/checkerboard/start.rs"]
mod start;
mod statistics;
mod weakness;
