//! All tests of the crate as one program: linked once, run side by side.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::type_complexity,
    clippy::unwrap_used,
    missing_docs
)]

mod boards;
mod circles;
mod coded;
mod dot_grids;
mod eccentricity;
mod judged;
mod lights;
mod real_boards;
mod real_dots;
mod rendering;
mod spheres;
mod support;
