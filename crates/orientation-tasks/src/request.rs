//! What is to be oriented, and by what.

use std::path::PathBuf;

/// Which stations to orient by what.
#[derive(Debug, Clone)]
pub struct OrientRequest {
    /// A survey; only its tables and the times of its frames are read.
    pub survey: PathBuf,
    /// By what.
    pub by: OrientBy,
    /// Calibration of the camera; `None`: the one beside the survey, or the nominal camera.
    pub calibration: Option<PathBuf>,
    /// Output folder; written beside and renamed when everything is done.
    pub out: PathBuf,
}

/// By what stations are oriented.
#[derive(Debug, Clone)]
pub enum OrientBy {
    /// `observations.csv`, with the coordinates of `targets.csv` as control, or without any as tie points.
    Targets {
        /// Standard deviation of image points without one, pixel; `None`: they are refused.
        sigma_pixel: Option<f64>,
        /// The same of ranges, metre.
        sigma_range_m: Option<f64>,
    },
    /// The inertial data that the survey names, from the poses of `stations.csv` on.
    Imu {
        /// Known poses (`stations.csv` or a trajectory); `None`: `stations.csv` of the survey.
        known: Option<PathBuf>,
    },
    /// Poses of a tracker, a robot or satellites.
    Tracker(TrackerOptions),
}

/// Poses of something that carries the camera.
#[derive(Debug, Clone)]
pub struct TrackerOptions {
    /// The carrier's poses, TUM or `EuRoC`; the axes are those of the file.
    pub poses: PathBuf,
    /// Stations whose poses are known (`stations.csv` or a trajectory); `None`: `stations.csv` of the survey.
    pub known: Option<PathBuf>,
    /// Largest difference between the clocks either way, second; `None`: they are one.
    pub time_offset_within_s: Option<f64>,
    /// Perspective centre in the carrier's axes, metre, good to 5 mm; `None`: it is found.
    pub lever_arm_m: Option<[f64; 3]>,
    /// Standard deviation of the tracker's positions, metre. Default 0.005.
    pub sigma_position_m: f64,
    /// Standard deviation of the tracker's attitudes, radian. Default 0.0035 (0.2 degrees).
    pub sigma_attitude_rad: f64,
    /// Longest time between two poses of the tracker that are interpolated, second. Default 0.1.
    pub longest_gap_s: f64,
}

impl TrackerOptions {
    /// The defaults for a file of poses.
    pub fn new(poses: impl Into<PathBuf>) -> Self {
        Self {
            poses: poses.into(),
            known: None,
            time_offset_within_s: None,
            lever_arm_m: None,
            sigma_position_m: 0.005,
            sigma_attitude_rad: 0.0035,
            longest_gap_s: 0.1,
        }
    }
}

impl OrientBy {
    /// `targets`, `imu` or `tracker`.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Targets { .. } => "targets",
            Self::Imu { .. } => "imu",
            Self::Tracker(_) => "tracker",
        }
    }
}
