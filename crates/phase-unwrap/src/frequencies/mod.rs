//! Several frequencies: hypotheses of the range.

pub(crate) mod combine;
pub(crate) mod fold;
pub(crate) mod frame;
pub(crate) mod hypotheses;
pub(crate) mod intervals;
pub(crate) mod kernel_density;
pub(crate) mod lanes;
pub(crate) mod lattice;
pub(crate) mod multi_frequency;
pub(crate) mod rows;
