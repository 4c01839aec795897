//! Tables of a survey: CSV with a header row, commas and decimal points. An empty field means "not observed".
//!
//! Columns may stand in any order. A column that is unknown, missing or given twice is refused, and so is a number that
//! is not finite; every fault names file, line and column.

mod csv_table;
mod distances;
mod imu;
mod imu_sensor;
mod observations;
mod planes;
mod residuals;
mod stations;
mod targets;

pub use csv_table::PlacedRows;
pub use distances::{Distance, read_distances, read_placed_distances, write_distances};
pub use imu::{ImuSample, read_imu, write_imu};
pub use imu_sensor::{ImuSensor, read_imu_sensor};
pub use observations::{TargetObservation, read_observations, read_placed_observations, write_observations};
pub use planes::{ObservedPlane, read_placed_planes, read_planes, write_planes};
pub use residuals::{Residual, read_residuals, write_residuals};
pub use stations::{Station, read_placed_stations, read_stations, write_stations};
pub use targets::{Target, read_placed_targets, read_targets, write_targets};
