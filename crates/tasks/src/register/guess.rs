//! Approximate poses from a file.

use std::path::Path;

use nalgebra::Isometry3;
use pipeline::stations::Station;
use pipeline::{Error, Result};
use range_io::tables::{Station as StationRow, read_stations};
use range_io::trajectory::{StampedPose, read_any_trajectory, read_matrix};

/// Times of a trajectory and of frames belong together within this, second.
const SAME_TIME_S: f64 = 5e-3;

/// What a file says of poses.
pub(crate) enum Guess {
    /// By station.
    Stations(Vec<StationRow>),
    /// The second cloud's frame in the first's.
    Matrix(Isometry3<f64>),
    /// By time.
    Trajectory(Vec<StampedPose>),
}

impl Guess {
    /// Reads `stations.csv`, a trajectory, or sixteen numbers.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let of_stations = || range_io::read_text(path).is_ok_and(|text| text.trim_start().starts_with("station"));
        if path.extension().is_some_and(|ending| ending == "csv") && of_stations() {
            return Ok(Self::Stations(read_stations(path)?));
        }
        match read_matrix(path)? {
            Some(second_to_first) => Ok(Self::Matrix(second_to_first)),
            None => Ok(Self::Trajectory(read_any_trajectory(path)?)),
        }
    }

    /// The pose of a station at a time; a matrix belongs to none.
    pub(crate) fn pose(&self, station: &str, timestamp_s: f64) -> Option<Isometry3<f64>> {
        match self {
            Self::Stations(rows) => rows.iter().find(|row| row.station == station).map(|row| row.world_from_camera),
            Self::Trajectory(poses) => {
                let found = poses.iter().find(|pose| (pose.timestamp_s - timestamp_s).abs() < SAME_TIME_S);
                found.map(|pose| pose.world_from_camera)
            }
            Self::Matrix(_) => None,
        }
    }
}

/// Sets the approximate poses of all stations from `stations.csv`, a trajectory, or the matrix that leads from the second
/// cloud's frame to the first's.
pub(crate) fn apply(path: &Path, stations: &mut [Station]) -> Result<()> {
    let guess = Guess::read(path)?;
    if let Guess::Matrix(second_to_first) = guess {
        let [first, second] = stations else {
            let count = stations.len();
            return Err(wrong(path, &format!("holds one matrix, which is a guess for two clouds, not for {count}")));
        };
        first.approximate = Some(Isometry3::identity());
        second.approximate = Some(second_to_first);
        return Ok(());
    }
    for station in stations {
        let (name, time) = (&station.name, station.timestamp_s);
        let pose = guess.pose(name, time);
        let none = || wrong(path, &format!("has no pose of station {name} (time {time} s)"));
        station.approximate = Some(pose.ok_or_else(none)?);
        station.approximate_sigma = [None; 2];
    }
    Ok(())
}

fn wrong(path: &Path, message: &str) -> Error {
    Error::Request { command: "register", message: format!("{}: {message}", path.display()) }
}
