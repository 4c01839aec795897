//! Mean changes of range from frames, and their blocks.

pub(crate) mod blocks;
pub(crate) mod pixels;
pub(crate) mod sample;
