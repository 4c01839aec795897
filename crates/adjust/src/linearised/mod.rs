//! The model at a point: residuals and derivatives in flat memory.

pub(crate) mod evaluation;
pub(crate) mod layout;
pub(crate) mod linearisation;
