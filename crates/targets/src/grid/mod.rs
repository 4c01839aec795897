//! Points that lie in a grid, in perspective and through a lens.

pub(crate) mod homography;
pub(crate) mod lattice;
pub(crate) mod nearest;
pub(crate) mod scatter;
