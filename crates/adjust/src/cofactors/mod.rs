//! What the normal equations determine: rank decisions, null space and cofactors.

pub(crate) mod cofactor;
pub(crate) mod eliminated_cofactor;
pub(crate) mod images;
pub(crate) mod null_space;
pub(crate) mod rank;
