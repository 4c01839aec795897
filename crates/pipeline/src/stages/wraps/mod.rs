//! Whole ambiguity intervals.

pub(crate) mod repair;
pub(crate) mod unwrap;
