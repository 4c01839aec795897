//! Figures of a network, adjusted or planned.

pub(crate) mod coverage;
pub(crate) mod image_residuals;
pub(crate) mod map;
pub(crate) mod point_uncertainty;
pub(crate) mod range_error;
pub(crate) mod range_terms;
pub(crate) mod residuals;
pub(crate) mod spread;
