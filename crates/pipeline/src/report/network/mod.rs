//! The reports of a calibration network, adjusted or planned.

mod coverage;
mod heat_map;
mod image_residuals;
mod map;
mod page;
mod plan_page;
mod point_uncertainty;
mod range_error;
mod residuals;
mod tables;

pub(crate) use page::render_calibration;
pub(crate) use plan_page::render_plan;
