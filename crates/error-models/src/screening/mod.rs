//! Which measurements fit no surface.

pub(crate) mod beside_edges;
pub(crate) mod gross_errors;
pub(crate) mod mixed_pixels;
pub(crate) mod plane_block;
pub(crate) mod straight_line;
