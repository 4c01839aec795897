//! All tests of the crate as one program: linked once, run side by side.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::type_complexity,
    clippy::unwrap_used,
    missing_docs
)]

mod all_effects;
mod all_effects_warm_up;
mod amplitude_or_position;
#[path = "../../warm-up/tests/drift_captures.rs"]
mod drift_captures;
mod further_terms;
mod offset_table;
mod planes;
mod range_terms;
mod real_floor;
mod real_hyperbola;
#[path = "support/round.rs"]
mod round;
mod support;
mod surfaces;
mod surfaces_broken;
mod unknown_planes;
