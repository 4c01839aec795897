//! The inertial data that a survey names.

use std::path::Path;

use nalgebra::Isometry3;
use range_io::survey::Survey;
use range_io::tables::{ImuSample, read_imu};
use range_io::trajectory::read_matrix;

use crate::{Error, Result};

/// Name among a survey's extras of inertial data: `imu.csv`, or an `EuRoC` folder.
pub const INERTIAL_DATA: &str = "imu";
/// Name among them of sixteen numbers, row by row: the pose of the unit's axes in the camera's (photogrammetric).
pub const INERTIAL_MOUNTING: &str = "camera_from_imu";

/// Reads the inertial data that a survey names and the pose of the unit's axes in the camera's, the identity where none is
/// named; `None` without data.
///
/// # Errors
/// Those of [`read_imu`] and [`read_matrix`]; [`Error::Survey`] for a mounting that is no matrix.
pub fn read_inertial(survey: &Survey, root: &Path) -> Result<Option<(Vec<ImuSample>, Isometry3<f64>)>> {
    let Some(file) = survey.extras.get(INERTIAL_DATA) else { return Ok(None) };
    let samples = read_imu(root.join(file))?;
    let Some(file) = survey.extras.get(INERTIAL_MOUNTING) else { return Ok(Some((samples, Isometry3::identity()))) };
    let path = root.join(file);
    let mounting = read_matrix(&path)?;
    let message = "expected the sixteen numbers of a 4 x 4 matrix".to_owned();
    Ok(Some((samples, mounting.ok_or(Error::Survey { path, message })?)))
}
