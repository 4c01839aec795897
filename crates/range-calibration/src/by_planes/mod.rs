//! Calibration by planes.

pub(crate) mod planes;
pub(crate) mod planes_geometry;
pub(crate) mod planes_observation;
pub(crate) mod planes_outcome;
pub(crate) mod planes_pixels;
pub(crate) mod planes_problem;
pub(crate) mod planes_reduction;
pub(crate) mod planes_selection;
pub(crate) mod planes_start;
