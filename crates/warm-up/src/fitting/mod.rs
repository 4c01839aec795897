//! The curve of a drift, its projection on data, and their correlated noise.

pub(crate) mod curve;
pub(crate) mod projection;
pub(crate) mod whitening;
