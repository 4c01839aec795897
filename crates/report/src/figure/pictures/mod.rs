//! Rasters as pictures.

pub(super) mod marks;
pub(super) mod pattern;
pub(super) mod picture;
