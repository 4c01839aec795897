//! Planes, differences of ranges and what is estimated.

pub(crate) mod calibration;
pub(crate) mod options;
