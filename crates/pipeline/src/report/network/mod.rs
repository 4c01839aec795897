//! The report of a calibration network.

mod coverage;
mod heat_map;
mod image_residuals;
mod map;
mod page;
mod point_uncertainty;
mod range_error;
mod residuals;
mod tables;

pub(crate) use page::render_calibration;
