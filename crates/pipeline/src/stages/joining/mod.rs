//! Stations brought into one frame.

pub(crate) mod adjust;
pub(crate) mod register;
