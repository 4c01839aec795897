//! Noise of samples and of ranges.

pub(crate) mod noise;
pub(crate) mod range_noise;
