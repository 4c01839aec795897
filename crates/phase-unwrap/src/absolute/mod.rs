//! Whole ambiguity intervals of segments from amplitudes and planes.

pub(crate) mod brightness;
pub(crate) mod labelling;
pub(crate) mod offsets;
pub(crate) mod planes;
