//! Rigs of known truth, and broken ones.
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs, dead_code)]

#[path = "support/rigs.rs"]
mod rigs;

mod broken;
mod hold_out;
mod mountings;
