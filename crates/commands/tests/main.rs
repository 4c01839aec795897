//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::unwrap_used, missing_docs)]

mod memory;
mod outputs;
mod plans;
