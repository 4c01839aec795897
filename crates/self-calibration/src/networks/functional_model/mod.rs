//! Observation equations, their unknowns, and residuals at given values.

pub(crate) mod builder;
pub(crate) mod equations;
pub(crate) mod hyperbola_steps;
pub(crate) mod image_model;
pub(crate) mod misfit;
pub(crate) mod problem;
pub(crate) mod term_priors;
pub(crate) mod terms;
