//! All tests of the crate as one program: linked once, run side by side.

#![allow(clippy::expect_used, clippy::float_cmp, clippy::panic, clippy::unwrap_used, missing_docs)]

mod fused;
mod lengths;
mod refusals;
mod results;
// Surveys of known shapes with errors drawn from their covariance.
#[path = "../../measurement/tests/scene/mod.rs"]
mod scene;
