//! Planned stations and targets to a network.

use std::path::Path;

use commands::root_of;
use nalgebra::{Matrix3, Point3, Vector3};
use pipeline::Result;
use range_io::survey::Survey;
use range_io::tables::{read_stations, read_targets};
use self_calibration::{Network, NetworkTarget, Station};

use crate::calibrate::{Start, named_distances};

/// Reads `survey.ron`, `stations.csv`, `targets.csv` and, where it is there, `distances.csv`.
///
/// Standard deviations of the tables are those that control will have. Observations are not read: every target in
/// the image of a station counts as seen.
pub(crate) fn read_plan(survey_path: &Path, calibration: Option<&Path>) -> Result<(Network, Start)> {
    let survey = Survey::read(survey_path)?;
    let root = root_of(survey_path);
    let start = Start::read(&survey, &root, calibration)?;
    let stations = read_stations(root.join("stations.csv"))?;
    let targets = read_targets(root.join("targets.csv"))?;
    let mut network = Network {
        camera: start.camera,
        range_model: start.range_model.clone(),
        stations: stations
            .iter()
            .map(|row| Station {
                name: row.station.clone(),
                world_from_camera: Some(row.world_from_camera),
                covariance: row.covariance(),
                integration_time_s: None,
                drift_m: 0.0,
            })
            .collect(),
        targets: targets
            .iter()
            .map(|row| NetworkTarget {
                name: row.target.clone(),
                point: Some(Point3::from(row.position_m)),
                covariance: row.sigma_m.map(|sigma| Matrix3::from_diagonal(&Vector3::from(sigma.map(|s| s * s)))),
            })
            .collect(),
        sightings: Vec::new(),
        distances: Vec::new(),
        passive: None,
    };
    network.distances = named_distances(&root.join("distances.csv"), &network.stations, &network.targets)?;
    Ok((network, start))
}
