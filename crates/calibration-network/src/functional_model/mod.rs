//! Observation equations, their unknowns, and residuals at given values.

pub(crate) mod builder;
pub(crate) mod component;
mod control;
pub(crate) mod equations;
pub(crate) mod hyperbola_steps;
pub(crate) mod image_model;
pub(crate) mod misfit;
pub(crate) mod setup;
mod solving;
pub(crate) mod term_priors;
pub(crate) mod terms;

pub use component::Component;
pub use equations::PartialPrior;
pub use hyperbola_steps::{OfTerms, by_steps, covariance_of_terms, has_natural_steps, range_block};
pub use misfit::{CAUCHY, Misfit, Scales, implausibility, modelled_pixel};
pub use setup::{BlockPrior, Blocks, Calibration, Datum, Excluded, RangeSet, Row, Setup, Solved, Source, Start};
pub use solving::{solve_rig, solve_rig_nearby};
pub use term_priors::{TILT_M, WAVE_M, usual_sigmas};
pub use terms::{
    ModelledRange, SINES, Seen, camera_names, camera_values, family_widths, modelled_range, range_model_from,
    range_names,
};
