//! Discs: found as components of the level sets, measured by a model of their blurred edge.

pub(crate) mod components;
pub(crate) mod disc_fit;
pub(crate) mod disc_model;
pub(crate) mod eccentricity;
pub(crate) mod ellipse;
pub(crate) mod find;
pub(crate) mod options;
mod rough_fit;
