//! Poses that many correspondences agree on.

pub(crate) mod correspondences;
pub(crate) mod graph;
pub(crate) mod matching;
pub(crate) mod sparse;
