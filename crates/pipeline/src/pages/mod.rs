//! The pages that a person wants to see, with their pictures.

mod comparison;
mod correction_maps;
mod fixed_pattern;
mod network;
mod noise;
mod registration;
mod registration_residuals;
mod scattering;
mod sections;
mod tracking;
mod trends;
mod warm_up;

pub(crate) use comparison::render_comparison;
pub(crate) use fixed_pattern::render_fixed_pattern;
pub(crate) use network::{render_calibration, render_certificate, render_plan};
pub(crate) use noise::render_noise;
pub(crate) use registration::render_registration;
pub(crate) use scattering::render_scattering;
pub(crate) use sections::render;
pub(crate) use tracking::render_tracking;
pub(crate) use warm_up::render_warm_up;
