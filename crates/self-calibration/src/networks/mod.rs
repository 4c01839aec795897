//! Start values that networks need.

pub(crate) mod hyperbola_start;
pub(crate) mod network;
