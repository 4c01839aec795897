//! An image as unwrapping sees it: slopes, cuts, segments and their borders.

pub(crate) mod bends;
pub(crate) mod borders;
pub(crate) mod continuity;
pub(crate) mod cuts;
pub(crate) mod known;
pub(crate) mod logarithm;
pub(crate) mod segments;
pub(crate) mod surface;
