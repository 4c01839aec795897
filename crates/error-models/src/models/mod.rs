//! The terms of a range error and how they are put together.

pub(crate) mod further;
pub(crate) mod hyperbola;
pub(crate) mod legendre;
pub(crate) mod linear;
pub(crate) mod model;
pub(crate) mod model_set;
pub(crate) mod parameters;
pub(crate) mod polynomial;
pub(crate) mod spline;
pub(crate) mod steepest;
pub(crate) mod terms;
