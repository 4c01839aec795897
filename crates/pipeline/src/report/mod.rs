//! The report: one page with the pictures that a person wants to see.

mod chart;
mod cloud_figure;
mod colour;
mod page;
mod picture;
mod sections;

pub(crate) use sections::render;
