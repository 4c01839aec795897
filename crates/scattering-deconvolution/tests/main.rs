//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::expect_used, clippy::panic, clippy::print_stdout, clippy::unwrap_used)]

#[path = "common/captures.rs"]
mod captures;
mod common;
mod composite;
mod estimation;
mod estimation_accuracy;
mod estimation_robust;
mod masks;
mod outside;
mod outside_dim;
mod refusals;
mod restoration;
mod scattering;
#[path = "common/scenes.rs"]
mod scenes;
mod sigma;
mod whole_scenes;
