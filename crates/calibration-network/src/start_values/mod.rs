//! Approximate poses, coordinates and calibration, also where observations contradict each other.

mod image_start;
pub(crate) mod settle;
pub(crate) mod start;
pub(crate) mod start_calibration;
pub(crate) mod start_finder;
mod wrong_control;

pub use settle::{start_limit, start_range_limit};
pub use start::fits_as_given;
pub use start_calibration::{calibration_from, start_calibration};
pub use start_finder::{NEEDED, station_pose};
