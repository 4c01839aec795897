//! The registration of all stations as a whole: what goes in, and what comes out.

pub(crate) mod blind;
pub(crate) mod datum;
pub(crate) mod pairs;
pub(crate) mod point_residuals;
pub(crate) mod registration;
pub(crate) mod stations;
pub(crate) mod together;
