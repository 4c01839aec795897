//! All tests of the crate as one program.
#![allow(clippy::unwrap_used)]

mod against_dense;
mod growth;
mod networks;
