//! The report: one page with the pictures that a person wants to see.

mod canvas;
mod chart;
mod cloud_figure;
mod colour;
mod comparison;
mod deviation_figure;
mod network;
mod page;
mod picture;
mod registration;
mod registration_residuals;
mod scattering;
mod sections;
mod station_graph;
mod tracking;

pub(crate) use comparison::render_comparison;
pub(crate) use network::{render_calibration, render_plan};
pub(crate) use registration::render_registration;
pub(crate) use scattering::render_scattering;
pub(crate) use sections::render;
pub(crate) use tracking::render_tracking;
