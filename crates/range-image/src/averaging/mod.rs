//! Frames of a station to one: means, rest and fusion of exposures.

pub(crate) mod average;
pub(crate) mod fusion;
pub(crate) mod fusion_bias;
pub(crate) mod mean_flags;
pub(crate) mod rest;
pub(crate) mod rest_pixel;
