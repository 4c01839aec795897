//! What is to be done with a result, and where.

use std::path::PathBuf;

use range_io::clouds::CloudFormat;

/// What to measure in which result.
#[derive(Debug, Clone)]
pub struct MeasureRequest {
    /// Folder of a result: `cloud.ply`, and `common_errors.ron` with the calibration that it names.
    pub result: PathBuf,
    /// Regions and lengths: a RON file of a [`MeasurePlan`](crate::MeasurePlan).
    pub lengths: PathBuf,
    /// Output folder; written beside and renamed when everything is done.
    pub out: PathBuf,
}

/// Which result's cloud to fuse, and how.
#[derive(Debug, Clone)]
pub struct FuseRequest {
    /// Folder of a result: `cloud.ply`, `common_errors.ron` and the calibration that it names.
    pub result: PathBuf,
    /// Spacing of the fused points, metre; `None`: that of [`fusion::FusionOptions`].
    pub voxel_m: Option<f64>,
    /// Whether points stay where they are and common errors are as stated; otherwise they are estimated and taken off.
    pub as_stated: bool,
    /// Format of the clouds: PLY, PCD or E57.
    pub format: CloudFormat,
    /// Output folder; written beside and renamed when everything is done.
    pub out: PathBuf,
}
