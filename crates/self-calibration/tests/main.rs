//! All tests of the crate as one program: linked once, run side by side.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::type_complexity,
    clippy::unwrap_used,
    missing_docs
)]

mod automatic_terms;
mod bad_networks;
mod contradictions;
mod contradictions_by_method;
mod control;
mod global_tests;
mod gross_errors;
mod hyperbola_of_a_network;
mod independent_adjustment;
mod methods;
mod network_terms;
mod one_step;
mod plan;
mod support;
mod term_scores;
mod weak_networks;
mod whole_intervals;
