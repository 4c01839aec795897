//! What is known before: the network as it was observed, options, and whether both make sense.

pub(crate) mod check;
pub(crate) mod model;
pub(crate) mod options;
pub(crate) mod outside_image;
