//! What a frame goes through, and the buffers for it.

pub(crate) mod counts;
pub(crate) mod planes;
#[cfg(feature = "tracking")]
pub(crate) mod pose;
pub(crate) mod rows;
