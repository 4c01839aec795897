//! Differences of stations of the same name.

use std::path::Path;

use pipeline::{Error, Result};
use range_io::tables::read_stations;
use serde::Serialize;

/// Differences of poses.
#[derive(Debug, Clone, Serialize)]
pub struct PoseComparison {
    /// Poses that both have.
    pub poses: usize,
    /// Poses of the first that the second has not.
    pub only_first: usize,
    /// Poses of the second that the first has not.
    pub only_second: usize,
    /// Root mean square difference of the positions, metre.
    pub position_rms_m: f64,
    /// Largest difference of the positions, metre.
    pub position_max_m: f64,
    /// Largest difference of the attitudes, degree.
    pub attitude_max_deg: f64,
    /// Each station.
    pub stations: Vec<PoseDifference>,
}

/// Difference of one pose, first less second.
#[derive(Debug, Clone, Serialize)]
pub struct PoseDifference {
    /// Name of the station.
    pub station: String,
    /// Difference of the positions, metre.
    pub position_m: [f64; 3],
    /// Angle between the attitudes, degree.
    pub attitude_deg: f64,
}

pub(crate) fn compare(first: &Path, second: &Path) -> Result<PoseComparison> {
    let (ours, reference) = (read_stations(first)?, read_stations(second)?);
    let mut stations = Vec::new();
    for row in &ours {
        let Some(other) = reference.iter().find(|candidate| candidate.station == row.station) else { continue };
        let (a, b) = (&row.world_from_camera, &other.world_from_camera);
        stations.push(PoseDifference {
            station: row.station.clone(),
            position_m: (a.translation.vector - b.translation.vector).into(),
            attitude_deg: a.rotation.angle_to(&b.rotation).to_degrees(),
        });
    }
    if stations.is_empty() {
        let (first, second) = (first.display(), second.display());
        return Err(Error::Compare(format!("{first} and {second} have no station in common")));
    }
    let lengths: Vec<f64> = stations.iter().map(|row| nalgebra::Vector3::from(row.position_m).norm()).collect();
    let mean_square = lengths.iter().map(|d| d * d).sum::<f64>() / lengths.len() as f64;
    Ok(PoseComparison {
        poses: stations.len(),
        only_first: ours.len() - stations.len(),
        only_second: reference.len() - stations.len(),
        position_rms_m: mean_square.sqrt(),
        position_max_m: lengths.iter().copied().fold(0.0, f64::max),
        attitude_max_deg: stations.iter().map(|row| row.attitude_deg).fold(0.0, f64::max),
        stations,
    })
}
