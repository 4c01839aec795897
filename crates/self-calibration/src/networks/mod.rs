//! Networks of targets, and the start values of a hyperbola that they need.

pub(crate) mod hyperbola_start;
pub(crate) mod network;
