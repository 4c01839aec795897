//! Pairs of stations, the loops that they form, and whether views contradict each other.

pub(crate) mod alignments;
pub(crate) mod judges;
pub(crate) mod loops;
pub(crate) mod placement;
