//! The reports of a calibration network, adjusted or planned.

mod certificate_page;
mod certificate_parts;
mod coverage;
mod image_residuals;
mod map;
mod page;
mod plan_page;
mod point_uncertainty;
mod range_error;
mod residuals;
mod spread;
mod tables;

pub(crate) use certificate_page::render_certificate;
pub(crate) use page::render_calibration;
pub(crate) use plan_page::render_plan;
