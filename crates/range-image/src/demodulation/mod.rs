//! From raw samples to phase, amplitude and offset.

pub(crate) mod alias;
pub(crate) mod demodulate;
pub(crate) mod harmonics;
pub(crate) mod polar_level;
pub(crate) mod samples;
pub(crate) mod weights;
pub(crate) mod wide_registers;
