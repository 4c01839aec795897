//! The methods of calibration: in one step, in two, of two networks.

mod combine;
pub(crate) mod problem;
mod range_step;
mod reference;
mod score;
