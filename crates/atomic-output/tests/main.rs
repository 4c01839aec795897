//! All tests of the crate as one program.
#![allow(clippy::expect_used, clippy::float_cmp, clippy::panic, clippy::unwrap_used)]

mod outputs;
