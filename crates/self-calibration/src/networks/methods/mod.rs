//! The methods of calibration: in one step, in two, of two networks.

pub(crate) mod calibrate;
pub(crate) mod combine;
pub(crate) mod range_step;
