//! What comes out: values, covariances, quality, what is determined weakly.

pub(crate) mod diagnosis;
pub(crate) mod display;
pub(crate) mod information;
pub(crate) mod joint;
pub(crate) mod left_out;
pub(crate) mod quality;
pub(crate) mod solution;
pub(crate) mod transformation;
pub(crate) mod weakness;
