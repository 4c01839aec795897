//! Minimum spanning trees over an image and the counts along them.

pub(crate) mod candidates;
pub(crate) mod contraction;
pub(crate) mod cycle;
pub(crate) mod forest;
pub(crate) mod grid;
pub(crate) mod options;
pub(crate) mod reliability;
pub(crate) mod seams;
pub(crate) mod steps;
pub(crate) mod unwrapped;
