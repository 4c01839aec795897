use std::path::Path;

use camera_model::{euler_from_pose, pose_covariance, pose_from_euler};
use nalgebra::{Isometry3, Matrix6, Vector3};

use super::csv_table::{Columns, PlacedRows, Row, Table, texts, write};
use crate::Result;

/// The pose of one station: `stations.csv`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Station {
    /// Name.
    pub station: String,
    /// Perspective centre and attitude (Eq. 2), photogrammetric axes.
    pub world_from_camera: Isometry3<f64>,
    /// Standard deviations of the perspective centre in metres.
    pub sigma_position_m: Option<[f64; 3]>,
    /// Standard deviations of omega, phi, kappa in radian.
    pub sigma_attitude_rad: Option<[f64; 3]>,
    /// What speaks against the pose, in words; `None` where nothing does.
    pub doubt: Option<String>,
}

impl Station {
    /// See [`pose_covariance`].
    pub fn covariance(&self) -> Option<Matrix6<f64>> {
        pose_covariance(&self.world_from_camera, self.sigma_position_m, self.sigma_attitude_rad)
    }
}

const POSITION: [&str; 3] = ["x", "y", "z"];
const ATTITUDE: [&str; 3] = ["omega", "phi", "kappa"];
const SIGMA_POSITION: [&str; 3] = ["sigma_x", "sigma_y", "sigma_z"];
const SIGMA_ATTITUDE: [&str; 3] = ["sigma_omega", "sigma_phi", "sigma_kappa"];
const COLUMNS: Columns = Columns {
    required: &["station", "x", "y", "z", "omega", "phi", "kappa"],
    optional: &["sigma_x", "sigma_y", "sigma_z", "sigma_omega", "sigma_phi", "sigma_kappa", DOUBT],
};
const DOUBT: &str = "doubt";

/// Reads `stations.csv`, angles in degrees. A station may stand in one row only.
pub fn read_stations(path: impl AsRef<Path>) -> Result<Vec<Station>> {
    Ok(read_placed_stations(path)?.rows)
}

/// Reads `stations.csv` and keeps the place of each row.
pub fn read_placed_stations(path: impl AsRef<Path>) -> Result<PlacedRows<Station>> {
    let table = Table::read(path.as_ref(), &COLUMNS)?;
    table.require_unique("station")?;
    table.placed(|row| {
        let position = Vector3::from(row.all(POSITION)?);
        let sigma_attitude_deg = row.all_or_none(SIGMA_ATTITUDE, Row::positive)?;
        Ok(Station {
            station: row.text("station")?,
            world_from_camera: pose_from_euler(position, row.all(ATTITUDE)?.map(f64::to_radians)),
            sigma_position_m: row.all_or_none(SIGMA_POSITION, Row::positive)?,
            sigma_attitude_rad: sigma_attitude_deg.map(|sigma| sigma.map(f64::to_radians)),
            doubt: row.words(DOUBT)?,
        })
    })
}

/// Writes `stations.csv`, angles in degrees; the columns of standard deviations, and that of doubts, where any station has some.
pub fn write_stations(path: impl AsRef<Path>, stations: &[Station]) -> Result<()> {
    let with_sigma = stations.iter().any(|s| s.sigma_position_m.is_some() || s.sigma_attitude_rad.is_some());
    let sigmas: &[&str] = if with_sigma { &COLUMNS.optional[..6] } else { &[] };
    let doubt: &[&str] = if stations.iter().any(|s| s.doubt.is_some()) { &[DOUBT] } else { &[] };
    let header = [COLUMNS.required, sigmas, doubt].concat();
    let rows = stations.iter().map(|station| {
        let pose = &station.world_from_camera;
        let attitude_deg = euler_from_pose(pose).map(f64::to_degrees);
        let sigma_attitude_deg = station.sigma_attitude_rad.map(|sigma| sigma.map(f64::to_degrees));
        let mut row = vec![station.station.clone()];
        row.extend(texts(Some(<[f64; 3]>::from(pose.translation.vector))));
        row.extend(texts(Some(attitude_deg)));
        if with_sigma {
            row.extend(texts(station.sigma_position_m));
            row.extend(texts(sigma_attitude_deg));
        }
        row.extend(doubt.iter().map(|_| station.doubt.clone().unwrap_or_default()));
        row
    });
    write(path.as_ref(), &header, rows)
}
