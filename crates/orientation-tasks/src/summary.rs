//! What was found, by name.

use std::path::PathBuf;

use commands::{Doubt, Judged};
use serde::Serialize;

/// Stations with their poses.
#[derive(Debug, Clone, Default, Serialize)]
pub struct OrientSummary {
    /// `targets`, `imu` or `tracker`.
    pub by: &'static str,
    /// What was read.
    pub survey: String,
    /// The calibration in use, in words.
    pub calibration: String,
    /// What fixes the frame of the poses.
    pub datum: String,
    /// Stations that were oriented.
    pub stations: Vec<OrientedStation>,
    /// Stations that were not.
    pub not_oriented: Vec<NotOriented>,
    /// Observations that contradict the others and took no part.
    pub rejected: Vec<RejectedValue>,
    /// How the camera sits on what was tracked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mounting: Option<MountingSummary>,
    /// What the inertial unit is worth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inertial: Option<InertialSummary>,
    /// What a reader should know, in sentences.
    pub findings: Vec<String>,
    /// What speaks against the result.
    pub doubts: Vec<Doubt>,
    /// Time taken.
    pub seconds: f64,
    /// Where it was written.
    pub out: PathBuf,
}

/// One station.
#[derive(Debug, Clone, Serialize)]
pub struct OrientedStation {
    /// Name.
    pub name: String,
    /// Perspective centre, metre.
    pub position_m: [f64; 3],
    /// omega, phi, kappa, degree.
    pub attitude_deg: [f64; 3],
    /// Standard deviation of the position in space, metre; `None` for the datum.
    pub position_sigma_m: Option<f64>,
    /// Standard deviation of the attitude about all axes, degree.
    pub attitude_sigma_deg: Option<f64>,
    /// Targets that took part.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub targets: Option<usize>,
    /// Posterior standard deviation of unit weight of the station by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma0: Option<f64>,
}

/// A station without a pose.
#[derive(Debug, Clone, Serialize)]
pub struct NotOriented {
    /// Name.
    pub station: String,
    /// Why.
    pub reason: String,
}

/// A value that took no part.
#[derive(Debug, Clone, Serialize)]
pub struct RejectedValue {
    /// Station.
    pub station: String,
    /// Target; empty where the pose of the station itself is left out.
    pub target: String,
    /// What of it: `target`, `column`, `row`, `range` or `pose`.
    pub part: &'static str,
    /// Line of the table; 0 for poses.
    pub line: usize,
}

/// How the camera sits on what was tracked.
#[derive(Debug, Clone, Serialize)]
pub struct MountingSummary {
    /// Perspective centre in the carrier's axes, metre.
    pub lever_arm_m: [f64; 3],
    /// Its standard deviations, metre.
    pub lever_arm_sigma_m: [f64; 3],
    /// Axis times angle of `carrier_from_camera` (camera: x right, y up, looking along -z), degree.
    pub boresight_deg: [f64; 3],
    /// Standard deviation about all axes, degree.
    pub boresight_sigma_deg: f64,
    /// Time of the tracker less that of the camera, second, where it was found, and its standard deviation.
    pub time_offset_s: Option<[f64; 2]>,
    /// Known stations that took part.
    pub known_stations: usize,
    /// Observations minus unknowns.
    pub redundancy: i64,
    /// Posterior standard deviation of unit weight.
    pub sigma0: Option<f64>,
}

/// What the inertial unit is worth by itself.
#[derive(Debug, Clone, Serialize)]
pub struct InertialSummary {
    /// How velocity and biases were found: `rest` or `sequence` of known poses.
    pub start: &'static str,
    /// Bias of the rates, rad/s.
    pub gyro_bias_rad_s: [f64; 3],
    /// Bias of the specific forces, m/s²; of a start at rest it is part of gravity.
    pub accel_bias_m_s2: [f64; 3],
    /// Standard deviations of the poses by the time since the last known one.
    pub growth: Vec<SigmaAtTime>,
}

/// How well a pose is known after a time without help.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct SigmaAtTime {
    /// Time since the last known pose, second.
    pub seconds: f64,
    /// Standard deviation of the position in space, metre.
    pub position_m: f64,
    /// Standard deviation of the attitude about all axes, degree.
    pub attitude_deg: f64,
}

impl Judged for OrientSummary {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }
}
