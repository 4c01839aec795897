//! What a frame goes through, and the buffers for it.

pub(crate) mod complex;
pub(crate) mod counts;
pub(crate) mod one;
#[cfg(feature = "tracking")]
pub(crate) mod pose;
pub(crate) mod ranges;
pub(crate) mod rows;
pub(crate) mod several;
