//! Light put back to where it came from.

pub(crate) mod dependence;
pub(crate) mod frame;
pub(crate) mod mask;
pub(crate) mod model;
pub(crate) mod noise;
pub(crate) mod restorer;
pub(crate) mod rows;
pub(crate) mod scatterer;
pub(crate) mod sigma;
pub(crate) mod work;
