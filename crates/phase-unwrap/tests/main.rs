//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::expect_used, clippy::float_cmp, clippy::panic, clippy::print_stdout, clippy::unwrap_used, dead_code)]

mod absolute;
mod any_cycle;
mod common;
mod dark_rooms;
#[path = "../examples/peers_phase/files.rs"]
mod files;
#[path = "common/frequencies.rs"]
mod frequencies;
#[path = "common/fringes.rs"]
mod fringes;
mod insar;
mod jumps_and_dark_patches;
mod kernel_density;
mod kruskal;
mod least_cuts;
mod mri_echoes;
mod multi_frequency;
mod noisy;
mod noisy_absolute;
mod repair;
#[path = "../examples/peers_phase/room.rs"]
mod room;
mod sequence;
mod spatial;
mod steep_fringes;

// What the modules of the example ask their program for.
use dark_rooms::{Outcome, Size};
