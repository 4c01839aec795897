//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::expect_used, clippy::float_cmp, clippy::unwrap_used)]

mod bad_specs;
mod common;
mod error_free;
mod errors_alone;
mod fixtures;
mod multipath;
mod noise_and_threads;
mod scattering;
mod warming;
