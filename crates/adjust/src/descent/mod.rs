//! The way to the solution: damped and undamped steps.

pub(crate) mod damped;
pub(crate) mod descend;
pub(crate) mod iteration;
pub(crate) mod options;
pub(crate) mod polish;
pub(crate) mod runaway;
pub(crate) mod trace;
