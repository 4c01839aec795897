//! The calibration's page and its certificate.

pub(crate) mod certificate_page;
pub(crate) mod certificate_parts;
pub(crate) mod figures;
pub(crate) mod page;
pub(crate) mod tables;
