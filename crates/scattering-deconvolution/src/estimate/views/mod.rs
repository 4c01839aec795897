//! What of the frames takes part.

pub(in crate::estimate) mod blocks;
pub(in crate::estimate) mod capture;
pub(in crate::estimate) mod mask;
pub(in crate::estimate) mod noise;
pub(in crate::estimate) mod options;
pub(in crate::estimate) mod planes;
