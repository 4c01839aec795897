//! What comes out: values with their deviations, verdicts, and contradictions with their causes.

pub(crate) mod contradiction;
mod control;
mod global_tests;
pub(crate) mod outcome;
