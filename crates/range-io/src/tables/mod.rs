//! Tables of a survey: CSV with a header row, commas and decimal points. An empty field means "not observed".
//!
//! Columns may stand in any order. A column that is unknown, missing or given twice is refused, and so is a number that
//! is not finite; every fault names file, line and column.

mod csv_table;
mod imu;
mod observations;
mod stations;
mod targets;

pub use imu::{ImuSample, read_imu, write_imu};
pub use observations::{TargetObservation, read_observations, write_observations};
pub use stations::{Station, read_stations, write_stations};
pub use targets::{Target, read_targets, write_targets};
