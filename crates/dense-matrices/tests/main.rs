//! All tests of the crate as one program.
#![allow(clippy::unwrap_used)]

mod decompositions;
mod panel;
mod product;
