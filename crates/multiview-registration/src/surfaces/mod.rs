//! What each station sees by itself: patches of surfaces, their points and their noise.

pub(crate) mod extents;
pub(crate) mod grouping;
pub(crate) mod noise;
pub(crate) mod patch_size;
pub(crate) mod patches;
pub(crate) mod plane_fit;
pub(crate) mod point_model;
pub(crate) mod points;
pub(crate) mod regions;
