//! What is known before: the network as it was observed, and whether it makes sense.

pub(crate) mod check;
pub(crate) mod model;
pub(crate) mod outside_image;
