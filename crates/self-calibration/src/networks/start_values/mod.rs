//! Approximate poses, coordinates and calibration, also where observations contradict each other.

pub(crate) mod robust_pose;
pub(crate) mod settle;
pub(crate) mod start;
pub(crate) mod start_calibration;
pub(crate) mod start_finder;
