//! Products and factors of dense matrices.

pub(crate) mod dense;
pub(crate) mod panel;
pub(crate) mod product;
