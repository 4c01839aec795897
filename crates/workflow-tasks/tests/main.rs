//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::float_cmp, clippy::unwrap_used)]

mod fleet;
mod workflow;
