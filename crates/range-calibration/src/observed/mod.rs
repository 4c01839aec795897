//! A calibration of ranges, and what of it is estimated.

pub(crate) mod calibration;
pub(crate) mod hyperbola_start;
pub(crate) mod options;
