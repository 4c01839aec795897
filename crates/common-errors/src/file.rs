//! `common_errors.ron`, beside the cloud of a result.

use std::path::Path;

use nalgebra::{DMatrix, Isometry3, Quaternion, Translation3, UnitQuaternion};
use point_uncertainty::{Columns, CommonError, CommonErrors, SharedBySensor};
use range_io::ron_text;
use serde::{Deserialize, Serialize};

use crate::Result;

/// What the points of a cloud have in common.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommonErrorsFile {
    /// [`Self::FORMAT_VERSION`].
    pub format_version: u32,
    /// The calibration that ranges and rays were corrected with, relative to the folder of the file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<String>,
    /// What stands behind the values of `frame` of the cloud's points.
    pub frames: Vec<FrameErrors>,
    /// The errors, in the order of the rows of their covariance.
    pub errors: Vec<CommonError>,
    /// Lower triangle of their covariance, row by row, each error in its unit (that of a parameter; metre and radian of a pose).
    pub covariance: Vec<Vec<f64>>,
    /// What is not in it, in sentences.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub not_in_it: Vec<String>,
}

/// One frame, or mean of frames: where it stands, and how its points move with the common errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameErrors {
    /// Station, and frame or number of frames.
    pub view: String,
    /// Station.
    pub station: String,
    /// Perspective centre in the cloud's frame.
    pub position_m: [f64; 3],
    /// Rotation from the camera's axes (x right, y up, looking along -z) to the cloud's, `x y z w`.
    pub quaternion_xyzw: [f64; 4],
    /// Position of its range terms among the calibration's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range_model: Option<usize>,
    /// Columns of the errors that move its points.
    #[serde(default)]
    pub columns: Columns,
    /// The error that neighbouring pixels share, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor: Option<SharedBySensor>,
}

impl CommonErrorsFile {
    /// Name of the file in a folder of results.
    pub const FILE_NAME: &str = "common_errors.ron";
    /// The version of the format.
    pub const FORMAT_VERSION: u32 = 1;

    /// Writes the file.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        let text = ron_text::to_text(self)?;
        atomic_output::write_text(path, &text).map_err(range_io::Error::from)?;
        Ok(())
    }

    /// The errors with their covariance.
    ///
    /// # Errors
    /// [`crate::Error::Errors`] where the numbers are no covariance.
    pub fn common(&self) -> Result<CommonErrors> {
        let rows = self.covariance.len();
        let at = |row: usize, column: usize| self.covariance[row.max(column)].get(row.min(column)).copied();
        let covariance = DMatrix::from_fn(rows, rows, |row, column| at(row, column).unwrap_or(f64::NAN));
        Ok(CommonErrors::new(self.errors.clone(), covariance)?)
    }
}

impl FrameErrors {
    /// The pose.
    pub fn world_from_camera(&self) -> Isometry3<f64> {
        let [x, y, z, w] = self.quaternion_xyzw;
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let [x, y, z] = self.position_m;
        Isometry3::from_parts(Translation3::new(x, y, z), rotation)
    }
}
