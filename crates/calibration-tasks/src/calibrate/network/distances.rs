//! Known distances between stations and targets.

use std::path::Path;

use pipeline::Result;
use range_io::tables::{PlacedRows, read_placed_distances};
use self_calibration::{DistanceEnd, KnownDistance, NetworkTarget, Station};

use crate::calibrate::network::network_files::optional;

/// Reads `distances.csv`, where it is there. An end is a station or a target, and never both.
pub(crate) fn named_distances(
    path: &Path,
    stations: &[Station],
    targets: &[NetworkTarget],
) -> Result<Vec<KnownDistance>> {
    let rows = optional(path, read_placed_distances)?;
    let mut distances = Vec::with_capacity(rows.rows.len());
    for (index, row) in rows.rows.iter().enumerate() {
        distances.push(KnownDistance {
            from: end(&rows, index, "from", &row.from, (stations, targets))?,
            to: end(&rows, index, "to", &row.to, (stations, targets))?,
            distance_m: row.distance_m,
            sigma_m: row.sigma_m,
        });
    }
    Ok(distances)
}

fn end<T>(
    rows: &PlacedRows<T>,
    index: usize,
    column: &str,
    name: &str,
    (stations, targets): (&[Station], &[NetworkTarget]),
) -> Result<DistanceEnd> {
    let station = stations.iter().position(|station| station.name == name);
    let target = targets.iter().position(|target| target.name == name);
    match (station, target) {
        (Some(station), None) => Ok(DistanceEnd::Station(station)),
        (None, Some(target)) => Ok(DistanceEnd::Target(target)),
        (Some(_), Some(_)) => {
            let reason = format!("`{name}` is both a station and a target: give one of them another name");
            Err(rows.error(index, column, reason).into())
        }
        (None, None) => {
            let reason = format!("`{name}` is neither a station nor a target of this survey");
            Err(rows.error(index, column, reason).into())
        }
    }
}
