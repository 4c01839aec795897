//! A calibration of ranges, and what of it is estimated.

pub(crate) mod calibration;
pub(crate) mod options;
